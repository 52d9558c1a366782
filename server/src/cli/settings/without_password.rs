//! Addresses without their passwords.

/// The address without the user and password in it.
pub(in crate::cli) fn without_password(text: &str) -> String {
    let Some((scheme, rest)) = text.split_once("://") else { return text.to_owned() };
    match rest.rsplit_once('@') {
        Some((_, host)) => format!("{scheme}://...@{host}"),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passwords_in_addresses_are_hidden() {
        assert_eq!(without_password("nats://lab:s3@cret@broker:4222"), "nats://...@broker:4222");
        assert_eq!(without_password("nats://broker:4222"), "nats://broker:4222");
        assert_eq!(without_password("warn,gaitwright=info"), "warn,gaitwright=info");
    }
}
