// SPDX-License-Identifier: Apache-2.0
#define EIGEN_DONT_PARALLELIZE // small matrices: threads would only wait for each other
#include <Eigen/Dense>
#include <ceres/ceres.h>
#include <glog/logging.h>

#include <cmath>
#include <exception>
#include <memory>
#include <vector>

extern "C" {
#include "base/error.h"
}
#include "calibration/fit_ceres.h"

namespace
{

class Group : public ceres::CostFunction
{
  public:
    Group(const least_squares &problem, int group) : problem_(problem), group_(group)
    {
        set_num_residuals(problem.group_size);
        mutable_parameter_block_sizes()->push_back(problem.parameters);
    }

    bool Evaluate(double const *const *x, double *residuals, double **jacobians) const override
    {
        double *jacobian = jacobians ? jacobians[0] : nullptr;
        if (!problem_.numeric)
            return problem_.evaluate(problem_.context, group_, x[0], residuals, jacobian);
        return problem_.evaluate(problem_.context, group_, x[0], residuals, nullptr) &&
               (!jacobian || Differences(x[0], jacobian));
    }

  private:
    bool Differences(const double *x, double *jacobian) const
    {
        const int n = problem_.parameters, m = problem_.group_size;
        std::vector<double> at(x, x + n), low(m), high(m);
        for (int j = 0; j < n; j++) {
            const double step = 1e-6 * std::fmax(1.0, std::fabs(x[j]));
            at[j] = x[j] - step;
            if (!problem_.evaluate(problem_.context, group_, at.data(), low.data(), nullptr))
                return false;
            at[j] = x[j] + step;
            if (!problem_.evaluate(problem_.context, group_, at.data(), high.data(), nullptr))
                return false;
            at[j] = x[j];
            for (int i = 0; i < m; i++)
                jacobian[i * n + j] = (high[i] - low[i]) / (2 * step);
        }
        return true;
    }

    const least_squares &problem_;
    const int group_;
};

bool Solve(const least_squares &p, std::vector<double> &x, least_squares_result &result, error *err)
{
    ceres::Problem problem;
    for (int g = 0; g < p.groups; g++)
        problem.AddResidualBlock(
            new Group(p, g), p.robust > 0 ? new ceres::SoftLOneLoss(p.robust) : nullptr, x.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    options.max_num_iterations = p.iterations;
    options.function_tolerance = p.tolerance > 0 ? p.tolerance : 1e-10;
    options.logging_type = ceres::SILENT;
    options.num_threads = 1;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    result.iterations = static_cast<int>(summary.iterations.size());
    result.cost_before = summary.initial_cost;
    result.cost_after = summary.final_cost;
    if (summary.termination_type != ceres::CONVERGENCE)
        return fail(err, ERROR_DATA, "the fit did not converge: %.200s", summary.message.c_str());
    return true;
}

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// J'J at x, row by row of groups.
bool NormalMatrix(const least_squares &p, const double *x, Matrix &normal)
{
    Matrix jacobian(p.group_size, p.parameters);
    std::vector<double> residuals(p.group_size);
    double *jacobians[] = {jacobian.data()};
    normal.setZero(p.parameters, p.parameters);
    for (int g = 0; g < p.groups; g++) {
        if (!Group(p, g).Evaluate(&x, residuals.data(), jacobians))
            return false;
        normal.noalias() += jacobian.transpose() * jacobian;
    }
    return true;
}

} // namespace

bool least_squares_solve(const struct least_squares *problem, double *x,
                         struct least_squares_result *result, struct error *err)
try {
    FLAGS_minloglevel = google::GLOG_FATAL; // what went wrong is the caller's to print
    std::vector<double> at(x, x + problem->parameters);
    if (problem->parameters < 1 || problem->groups * problem->group_size < problem->parameters)
        return fail(err, ERROR_RANGE, "%d residuals cannot decide %d parameters",
                    problem->groups * problem->group_size, problem->parameters);
    if (!Solve(*problem, at, *result, err))
        return false;
    for (int j = 0; j < problem->parameters; j++)
        x[j] = at[j];
    return true;
} catch (const std::exception &e) {
    return fail(err, ERROR_SYSTEM, "the fit stopped: %s", e.what());
} catch (...) {
    return fail(err, ERROR_SYSTEM, "the fit stopped");
}

bool least_squares_covariance(const struct least_squares *problem, const double *x,
                              double *covariance, struct error *err)
try {
    const int n = problem->parameters;
    Matrix normal;
    if (!NormalMatrix(*problem, x, normal))
        return fail(err, ERROR_DATA, "no residuals at the solution");
    // In units of each parameter's own uncertainty alone.
    const Eigen::VectorXd unit = normal.diagonal().cwiseSqrt().cwiseInverse();
    normal = unit.asDiagonal() * normal * unit.asDiagonal();
    Eigen::LDLT<Matrix> factor(normal);
    if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 1e-12))
        return fail(err, ERROR_DATA, "the residuals do not decide every parameter");
    normal = factor.solve(Matrix::Identity(n, n));
    Eigen::Map<Matrix>(covariance, n, n) = unit.asDiagonal() * normal * unit.asDiagonal();
    return true;
} catch (const std::exception &e) {
    return fail(err, ERROR_SYSTEM, "no covariance: %s", e.what());
}

// design' weight design = q diag(d) q'.
struct ridge {
    Matrix q; // unknowns x unknowns
    Eigen::VectorXd d;
    Matrix turned; // sqrt(weight) design q
    Matrix value;  // sqrt(weight) value
    Eigen::VectorXd root;
    Matrix raw;  // value
    Matrix onto; // turned' value
};

struct ridge *ridge_create(const struct ridge_problem *p, struct error *err)
try {
    auto r = std::make_unique<ridge>();
    Eigen::Map<const Matrix> design(p->design, p->rows, p->unknowns);
    r->raw = Eigen::Map<const Matrix>(p->value, p->rows, p->values);
    r->root = Eigen::Map<const Eigen::VectorXd>(p->weight, p->rows).cwiseSqrt();
    Matrix scaled = r->root.asDiagonal() * design;
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled.transpose() * scaled);
    if (solver.info() != Eigen::Success) {
        fail(err, ERROR_DATA, "no decomposition of %d x %d", p->rows, p->unknowns);
        return nullptr;
    }
    r->q = solver.eigenvectors();
    r->d = solver.eigenvalues().cwiseMax(0);
    r->turned = scaled * r->q;
    r->onto = r->turned.transpose() * (r->root.asDiagonal() * r->raw);
    return r.release();
} catch (const std::exception &e) {
    fail(err, ERROR_SYSTEM, "the fit stopped: %s", e.what());
    return nullptr;
}

void ridge_destroy(struct ridge *r)
{
    delete r;
}

void ridge_solve(const struct ridge *r, double penalty, double *c)
{
    Eigen::VectorXd shrink = (r->d.array() + penalty).inverse();
    Eigen::Map<Matrix>(c, r->q.rows(), r->onto.cols()) = r->q * (shrink.asDiagonal() * r->onto);
}

void ridge_left_out(const struct ridge *r, double penalty, double *predicted)
{
    Eigen::VectorXd shrink = (r->d.array() + penalty).inverse();
    Matrix fitted = r->turned * (shrink.asDiagonal() * r->onto); // sqrt(weight) times the fit
    Eigen::VectorXd hat = r->turned.cwiseAbs2() * shrink;
    Eigen::Map<Matrix> out(predicted, r->raw.rows(), r->raw.cols());
    for (Eigen::Index i = 0; i < out.rows(); i++)
        out.row(i) = (fitted.row(i) / r->root[i] - hat[i] * r->raw.row(i)) / (1 - hat[i]);
}

double ridge_freedom(const struct ridge *r, double penalty)
{
    return (r->d.array() / (r->d.array() + penalty)).sum();
}

void ridge_covariance(const struct ridge *r, double penalty, double *covariance)
{
    Eigen::VectorXd shrink = (r->d.array() + penalty).inverse();
    Eigen::Map<Matrix>(covariance, r->q.rows(), r->q.rows()) =
        r->q * shrink.asDiagonal() * r->q.transpose();
}

bool principal_modes(const double *covariance, int n, int count, double *modes, struct error *err)
try {
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(
        Eigen::Map<const Matrix>(covariance, n, n));
    if (solver.info() != Eigen::Success)
        return fail(err, ERROR_DATA, "no principal modes of a covariance of %d", n);
    for (int k = 0; k < count; k++) {
        const int from = n - 1 - k; // eigenvalues rise
        Eigen::Map<Eigen::VectorXd>(modes + static_cast<long>(k) * n, n) =
            std::sqrt(std::fmax(0, solver.eigenvalues()[from])) * solver.eigenvectors().col(from);
    }
    return true;
} catch (const std::exception &e) {
    return fail(err, ERROR_SYSTEM, "no principal modes: %s", e.what());
}
