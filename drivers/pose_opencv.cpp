// SPDX-License-Identifier: Apache-2.0
#include "drivers/pose_opencv.h"

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <vector>

namespace
{

std::vector<cv::Point3d> points_of(const struct vec3 *model, int count)
{
    std::vector<cv::Point3d> points;
    for (int i = 0; i < count; i++)
        points.emplace_back(model[i].x, model[i].y, model[i].z);
    return points;
}

std::vector<cv::Point2d> pixels_of(const double (*image)[2], int count)
{
    std::vector<cv::Point2d> pixels;
    for (int i = 0; i < count; i++)
        pixels.emplace_back(image[i][0], image[i][1]);
    return pixels;
}

struct rigid rigid_of(const cv::Mat &rotation, const cv::Mat &translation)
{
    cv::Mat matrix;
    struct rigid out;
    cv::Rodrigues(rotation, matrix);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            out.rotation.m[r][c] = matrix.at<double>(r, c);
    out.translation = {translation.at<double>(0), translation.at<double>(1),
                       translation.at<double>(2)};
    return out;
}

bool finite(const struct rigid &pose)
{
    double sum = pose.translation.x + pose.translation.y + pose.translation.z;
    for (const auto &row : pose.rotation.m)
        sum += row[0] + row[1] + row[2];
    return std::isfinite(sum);
}

} // namespace

int pose_candidates(const struct vec3 model[POSE_POINTS], const double image[POSE_POINTS][2],
                    struct rigid out[POSE_MOST])
try {
    std::vector<cv::Mat> rotations, translations;
    int count = 0;
    cv::solveP3P(points_of(model, POSE_POINTS), pixels_of(image, POSE_POINTS), cv::Matx33d::eye(),
                 cv::noArray(), rotations, translations, cv::SOLVEPNP_P3P);
    for (size_t i = 0; i < rotations.size() && count < POSE_MOST; i++) {
        struct rigid pose = rigid_of(rotations[i], translations[i]);
        if (finite(pose))
            out[count++] = pose;
    }
    return count;
} catch (...) {
    return 0;
}

bool pose_refine(const struct vec3 *model, const double (*image)[2], int count, struct rigid *pose)
try {
    cv::Mat matrix(3, 3, CV_64F), rotation, translation(3, 1, CV_64F);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            matrix.at<double>(r, c) = pose->rotation.m[r][c];
    translation.at<double>(0) = pose->translation.x;
    translation.at<double>(1) = pose->translation.y;
    translation.at<double>(2) = pose->translation.z;
    cv::Rodrigues(matrix, rotation);
    cv::solvePnPRefineLM(
        points_of(model, count), pixels_of(image, count), cv::Matx33d::eye(), cv::noArray(),
        rotation, translation,
        cv::TermCriteria(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 40, 1e-12));
    struct rigid refined = rigid_of(rotation, translation);
    if (!finite(refined))
        return false;
    *pose = refined;
    return true;
} catch (...) {
    return false;
}
