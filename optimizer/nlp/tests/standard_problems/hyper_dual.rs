//! Hyper-dual numbers: value, two first derivatives and their mixed second derivative, without truncation error.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// v + a e1 + b e2 + ab e1 e2 with e1^2 = e2^2 = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual {
    pub v: f64,
    pub a: f64,
    pub b: f64,
    pub ab: f64,
}

impl Dual {
    pub const fn constant(v: f64) -> Self {
        Self { v, a: 0.0, b: 0.0, ab: 0.0 }
    }

    fn chain(self, f: f64, d: f64, dd: f64) -> Self {
        Self { v: f, a: d * self.a, b: d * self.b, ab: d * self.ab + dd * self.a * self.b }
    }

    pub fn sin(self) -> Self {
        self.chain(self.v.sin(), self.v.cos(), -self.v.sin())
    }

    pub fn cos(self) -> Self {
        self.chain(self.v.cos(), -self.v.sin(), -self.v.cos())
    }

    pub fn exp(self) -> Self {
        let e = self.v.exp();
        self.chain(e, e, e)
    }

    pub fn ln(self) -> Self {
        self.chain(self.v.ln(), 1.0 / self.v, -1.0 / (self.v * self.v))
    }

    pub fn powi(self, k: i32) -> Self {
        let p = |e: i32| if e < 0 { 0.0 } else { self.v.powi(e) };
        let (k0, k1) = (f64::from(k), f64::from(k - 1));
        self.chain(self.v.powi(k), k0 * p(k - 1), k0 * k1 * p(k - 2))
    }

    pub fn powf(self, k: f64) -> Self {
        self.chain(self.v.powf(k), k * self.v.powf(k - 1.0), k * (k - 1.0) * self.v.powf(k - 2.0))
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { v: self.v + o.v, a: self.a + o.a, b: self.b + o.b, ab: self.ab + o.ab }
    }
}
impl Sub for Dual {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { v: self.v - o.v, a: self.a - o.a, b: self.b - o.b, ab: self.ab - o.ab }
    }
}
impl Mul for Dual {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self {
            v: self.v * o.v,
            a: self.a * o.v + self.v * o.a,
            b: self.b * o.v + self.v * o.b,
            ab: self.ab * o.v + self.a * o.b + self.b * o.a + self.v * o.ab,
        }
    }
}
impl Div for Dual {
    type Output = Self;
    #[allow(clippy::suspicious_arithmetic_impl)] // a / b = a * (1 / b)
    fn div(self, o: Self) -> Self {
        let r = 1.0 / o.v;
        self * o.chain(r, -r * r, 2.0 * r * r * r)
    }
}
impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self::constant(0.0) - self
    }
}
impl Add<f64> for Dual {
    type Output = Self;
    fn add(self, o: f64) -> Self {
        Self { v: self.v + o, ..self }
    }
}
impl Sub<f64> for Dual {
    type Output = Self;
    fn sub(self, o: f64) -> Self {
        Self { v: self.v - o, ..self }
    }
}
impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(self, o: f64) -> Self {
        Self { v: self.v * o, a: self.a * o, b: self.b * o, ab: self.ab * o }
    }
}
impl Div<f64> for Dual {
    type Output = Self;
    fn div(self, o: f64) -> Self {
        self * (1.0 / o)
    }
}
impl Add<Dual> for f64 {
    type Output = Dual;
    fn add(self, o: Dual) -> Dual {
        o + self
    }
}
impl Sub<Dual> for f64 {
    type Output = Dual;
    fn sub(self, o: Dual) -> Dual {
        -o + self
    }
}
impl Mul<Dual> for f64 {
    type Output = Dual;
    fn mul(self, o: Dual) -> Dual {
        o * self
    }
}
impl Div<Dual> for f64 {
    type Output = Dual;
    fn div(self, o: Dual) -> Dual {
        Dual::constant(self) / o
    }
}
