//! Callers of an operation: sessions of each role, and tokens with each set of scopes.

use gaitwright_store::rights::{Right, Rights, Role};
use serde_json::Value;

/// Whether everybody who can call an operation with the old requirement can call it with the new one.
pub(super) fn all_can_still_call(old: &Value, new: &Value) -> bool {
    callers().iter().all(|caller| !caller.can_call(old) || caller.can_call(new))
}

struct Caller {
    /// The name of the security scheme, if the caller has signed in.
    scheme: &'static str,
    rights: Rights,
}

impl Caller {
    fn can_call(&self, requirement: &Value) -> bool {
        let alternatives = requirement.as_array().map_or(&[][..], Vec::as_slice);
        alternatives.is_empty() || alternatives.iter().any(|schemes| self.satisfies(schemes))
    }

    fn satisfies(&self, schemes: &Value) -> bool {
        let mut schemes = schemes.as_object().into_iter().flatten();
        schemes.all(|(scheme, scopes)| {
            let needed = scopes.as_array().into_iter().flatten();
            let has = |name: &Value| Right::ALL.iter().any(|right| name == right.as_str() && self.rights.has(*right));
            *scheme == self.scheme && needed.into_iter().all(has)
        })
    }
}

fn callers() -> Vec<Caller> {
    let mut all = vec![Caller { scheme: "", rights: Rights::default() }];
    all.extend(Role::ALL.map(|role| Caller { scheme: "session", rights: role.rights() }));
    let scopes: Vec<Right> = Right::ALL.into_iter().filter(|right| *right != Right::Administer).collect();
    for chosen in 0..1_u32 << scopes.len() {
        let set: Vec<Right> =
            scopes.iter().enumerate().filter(|(index, _)| chosen >> index & 1 == 1).map(|(_, right)| *right).collect();
        all.push(Caller { scheme: "token", rights: Rights::of(&set) });
    }
    all
}
