//! Rights as types: what a handler asks for in its arguments.

use gaitwright_store::rights::Right;

/// A right as a type: what a handler asks for in its arguments.
pub trait Permission: Send + Sync + 'static {
    /// The right; `None` if being signed in is sufficient.
    const NEEDED: Option<Right>;
}

macro_rules! permission {
    ($name:ident) => {
        #[doc = concat!("Asks for [`Right::", stringify!($name), "`].")]
        #[derive(Debug, Clone, Copy)]
        pub struct $name;

        impl Permission for $name {
            const NEEDED: Option<Right> = Some(Right::$name);
        }
    };
}

/// Asks for no right: any signed-in user and any token qualify.
#[derive(Debug, Clone, Copy)]
pub struct AnyCaller;

impl Permission for AnyCaller {
    const NEEDED: Option<Right> = None;
}

permission!(Read);
permission!(Run);
permission!(Answer);
permission!(Rate);
permission!(Device);
permission!(Administer);
