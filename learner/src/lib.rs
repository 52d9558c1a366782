//! Preference-based Bayesian learning over a finite grid of actions.
