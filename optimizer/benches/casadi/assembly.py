"""A sparse nonlinear program as a sum of small elements with symbolic derivatives.

Each element type is a function of a few local variables z (gathered from x) and constants p: rows r(z, p) and a share of
the objective f(z, p, w). CasADi differentiates the small functions symbolically (SX: exact, sparse, common
subexpressions shared), `map` evaluates them at all their instances, and the results are placed in the large matrices.
That is the fastest form CasADi offers for such a problem: no colouring of the large Jacobian, no large graph.
"""

import casadi as ca
import numpy as np


class Element:
    """An element type.

    z, p, w: SX columns (local variables, constants per instance, weights of the objective shared by all);
    rows: SX column; objective: SX scalar or None;
    variables: one list of indices into x per instance; constants: one list per instance; first_row: per instance.
    """

    def __init__(self, name, z, p, w, rows, objective, variables, constants, rows_at):
        self.name = name
        self.count = len(variables)
        self.variables = np.array(variables, dtype=int).T.reshape(z.numel(), self.count)
        assert all(len(set(column)) == z.numel() for column in self.variables.T), name
        self.constants = ca.DM(np.array(constants, dtype=float).T.reshape(p.numel(), self.count))
        self.rows_at = np.array(rows_at, dtype=int).T.reshape(rows.numel(), self.count)
        objective = ca.SX(0) if objective is None else objective
        multipliers, sigma = ca.SX.sym("multipliers", rows.numel()), ca.SX.sym("sigma")

        def function(kind, inputs, outputs):
            return ca.Function(f"{name}_{kind}", inputs, outputs, {"cse": True}).map(self.count)

        self.values = function("values", [z, p], [ca.densify(rows)])
        self.objective = function("objective", [z, p, w], [objective])
        gradient = ca.jacobian(objective, z).T
        self.gradient_rows = [gradient.sparsity().row(i) for i in range(gradient.nnz())]
        self.gradient = function("gradient", [z, p, w], [objective, ca.vertcat(*gradient.nonzeros())])
        jacobian = ca.jacobian(rows, z)
        self.jacobian_at = list(zip(*jacobian.sparsity().get_triplet())) if jacobian.nnz() else []
        self.jacobian = function("jacobian", [z, p], [ca.densify(rows), ca.vertcat(*jacobian.nonzeros())])
        lagrangian = sigma * objective + ca.dot(multipliers, rows)
        hessian = ca.triu(ca.hessian(lagrangian, z)[0])
        self.hessian_at = list(zip(*hessian.sparsity().get_triplet())) if hessian.nnz() else []
        self.hessian = function("hessian", [z, p, w, sigma, multipliers], [ca.vertcat(*hessian.nonzeros())])

    def gathered(self, x):
        return ca.reshape(x[self.variables.T.flatten().tolist()], *self.variables.shape)

    def repeated(self, value):
        return ca.repmat(value, 1, self.count)


def _accumulate(sparsity, triplets, values):
    """Sums `values`, one for each (row, column) of `triplets`, to a matrix of the given sparsity."""
    place = {at: i for i, at in enumerate(zip(*sparsity.get_triplet()))}
    slots = [place[at] for at in triplets]
    if len(set(slots)) == len(slots) == sparsity.nnz():
        order = np.argsort(slots, kind="stable")
        nonzeros = values[order.tolist()]
    else:
        sums = ca.DM.triplet(slots, list(range(len(slots))), ca.DM.ones(len(slots)), sparsity.nnz(), len(slots))
        nonzeros = sums @ values
    return ca.MX(sparsity, nonzeros)


class Program:
    """Functions f, g, gradient, Jacobian and Hessian of all elements, in the forms CasADi's nlpsol takes."""

    def __init__(self, elements, n, m, weights):
        self.elements, self.n, self.m = elements, n, m
        x, p = ca.MX.sym("x", n), ca.MX.sym("p", weights)
        sigma, multipliers = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", m)
        with_objective = [e for e in elements if e.gradient_rows]

        objective = sum(ca.sum2(e.objective(e.gathered(x), e.constants, e.repeated(p))) for e in with_objective)
        self.f = ca.Function("nlp_f", [x, p], [objective], ["x", "p"], ["f"])

        order = np.concatenate([e.rows_at.T.flatten() for e in elements])
        assert sorted(order) == list(range(m)), "every row written once"
        back = np.argsort(order).tolist()
        rows = ca.vertcat(*[ca.vec(e.values(e.gathered(x), e.constants)) for e in elements])[back]
        self.g = ca.Function("nlp_g", [x, p], [rows], ["x", "p"], ["g"])

        parts, values, total = [], [], 0
        for e in with_objective:
            f, v = e.gradient(e.gathered(x), e.constants, e.repeated(p))
            total = total + ca.sum2(f)
            parts += [(e.variables[i, k], 0) for k in range(e.count) for i in e.gradient_rows]
            values.append(ca.vec(v))
        gradient = ca.densify(_accumulate(_pattern(n, 1, parts), parts, ca.vertcat(*values)))
        self.grad_f = ca.Function("nlp_grad_f", [x, p], [total, gradient], ["x", "p"], ["f", "grad_f_x"])

        parts, values, row_values = [], [], []
        for e in elements:
            r, v = e.jacobian(e.gathered(x), e.constants)
            row_values.append(ca.vec(r))
            if e.jacobian_at:
                parts += [(e.rows_at[i, k], e.variables[j, k]) for k in range(e.count) for i, j in e.jacobian_at]
                values.append(ca.vec(v))
        jacobian = _accumulate(_pattern(m, n, parts), parts, ca.vertcat(*values))
        rows = ca.vertcat(*row_values)[back]
        self.jac_g = ca.Function("nlp_jac_g", [x, p], [rows, jacobian], ["x", "p"], ["g", "jac_g_x"])

        parts, values = [], []
        for e in elements:
            if not e.hessian_at:
                continue
            lam = ca.reshape(multipliers[e.rows_at.T.flatten().tolist()], *e.rows_at.shape)
            v = e.hessian(e.gathered(x), e.constants, e.repeated(p), e.repeated(sigma), lam)
            for k in range(e.count):
                at = [(e.variables[i, k], e.variables[j, k]) for i, j in e.hessian_at]
                parts += [(min(i, j), max(i, j)) for i, j in at]
            values.append(ca.vec(v))
        hessian = _accumulate(_pattern(n, n, parts), parts, ca.vertcat(*values))
        self.hess_lag = ca.Function(
            "nlp_hess_l",
            [x, p, sigma, multipliers],
            [hessian],
            ["x", "p", "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        )

    def functions(self):
        return [self.f, self.g, self.grad_f, self.jac_g, self.hess_lag]


def _pattern(rows, columns, parts):
    distinct = sorted(set((int(j), int(i)) for i, j in parts))
    return ca.Sparsity.triplet(rows, columns, [i for _, i in distinct], [j for j, _ in distinct])
