//! Rights as types: what a handler asks for in its arguments.

use gaitwright_store::rights::Right;

/// A right as a type: what a handler asks for in its arguments.
pub trait RequiredRight: Send + Sync + 'static {
    /// The right; `None` if being signed in is sufficient.
    const NEEDED: Option<Right>;
}

macro_rules! required_right {
    ($name:ident) => {
        #[doc = concat!("Asks for [`Right::", stringify!($name), "`].")]
        #[derive(Debug, Clone, Copy)]
        pub struct $name;

        impl RequiredRight for $name {
            const NEEDED: Option<Right> = Some(Right::$name);
        }
    };
}

/// Asks for no right: any signed-in user and any token qualify.
#[derive(Debug, Clone, Copy)]
pub struct AnyCaller;

impl RequiredRight for AnyCaller {
    const NEEDED: Option<Right> = None;
}

required_right!(Read);
required_right!(Run);
required_right!(Answer);
required_right!(Rate);
required_right!(Device);
required_right!(Administer);
