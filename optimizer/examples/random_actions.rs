//! Distinct random actions of Table I, in the format of `gaitwright sweep --actions`.
//!
//! `cargo run --release -p gait-optimizer --example random_actions -- [--count 200] [--seed 1] > actions.csv`

mod arguments;
mod splitmix;
mod tuned_actions;

use arguments::argument;
use gait_optimizer::TunedBounds;
use splitmix::SplitMix;
use std::collections::HashSet;
use std::error::Error;
use tuned_actions::LEVELS;

fn main() -> Result<(), Box<dyn Error>> {
    let count: usize = argument("--count", "200").parse()?;
    let mut random = SplitMix(argument("--seed", "1").parse()?);
    let all: usize = LEVELS.iter().map(|levels| levels.len()).product();
    if count > all {
        return Err(format!("--count: Table I has {all} actions").into());
    }
    println!("{}", TunedBounds::NAMES.join(","));
    let mut drawn = HashSet::new();
    while drawn.len() < count {
        let action = LEVELS.map(|levels| levels[random.below(levels.len())].to_string()).join(",");
        if drawn.insert(action.clone()) {
            println!("{action}");
        }
    }
    Ok(())
}
