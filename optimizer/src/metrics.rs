//! Figures of a gait: Gait RMSE against a reference.
