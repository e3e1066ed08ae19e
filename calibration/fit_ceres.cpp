// SPDX-License-Identifier: Apache-2.0
#include <ceres/ceres.h>
#include <glog/logging.h>

#include <cmath>
#include <exception>
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
    options.linear_solver_type = ceres::DENSE_QR;
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
