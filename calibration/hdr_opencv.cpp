// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>
#include <vector>

extern "C" {
#include "calibration/hdr_opencv.h"
}

namespace
{

constexpr int rounds_most = 400;
constexpr float ended = 1e-5F;
constexpr int told_least = 32;
constexpr double off_most = 1e-9; // of a focal length

// Three equal channels: Robertson's calibration of OpenCV 4.6 writes three
// whatever it was given.
std::vector<cv::Mat> frames_of(const uint8_t *codes, int frames, int pixels)
{
    int side = static_cast<int>(std::lround(std::sqrt(pixels)));
    std::vector<cv::Mat> all;
    for (int i = 0; i < frames; i++) {
        auto *from = const_cast<uint8_t *>(codes) + static_cast<size_t>(i) * pixels;
        cv::Mat one(side, side, CV_8UC1, from), three;
        cv::merge(std::vector<cv::Mat>{one, one, one}, three);
        all.push_back(three);
    }
    return all;
}

cv::Mat find(hdr_method method, const std::vector<cv::Mat> &frames,
             const std::vector<float> &seconds, int pixels)
{
    cv::Mat response;
    if (method == HDR_DEBEVEC)
        cv::createCalibrateDebevec(pixels)->process(frames, response, seconds);
    else
        cv::createCalibrateRobertson(rounds_most, ended)->process(frames, response, seconds);
    return response;
}

cv::Mat camera_of(const hdr_lens *lens)
{
    return (cv::Mat_<double>(3, 3) << lens->fx_px, 0, lens->cx_px, 0, lens->fy_px, lens->cy_px, 0,
            0, 1);
}

cv::Mat distortion_of(const hdr_lens *lens)
{
    return (cv::Mat_<double>(1, 5) << lens->k1, lens->k2, lens->p1, lens->p2, lens->k3);
}

void distort(const hdr_lens *lens, const double (*tangent)[2], int count, double (*px)[2])
{
    std::vector<cv::Point3d> points;
    std::vector<cv::Point2d> seen;
    cv::Vec3d none(0, 0, 0);
    for (int i = 0; i < count; i++)
        points.emplace_back(tangent[i][0], tangent[i][1], 1);
    cv::projectPoints(points, none, none, camera_of(lens), distortion_of(lens), seen);
    for (int i = 0; i < count; i++) {
        px[i][0] = seen[i].x;
        px[i][1] = seen[i].y;
    }
}

bool came_back(const hdr_lens *lens, const double (*px)[2], int count, const double (*tangent)[2],
               struct error *err)
{
    std::vector<double> room(2 * static_cast<size_t>(count));
    auto *back = reinterpret_cast<double(*)[2]>(room.data());
    if (count > 0)
        distort(lens, tangent, count, back);
    for (int i = 0; i < count; i++) {
        double off = std::hypot((back[i][0] - px[i][0]) / lens->fx_px,
                                (back[i][1] - px[i][1]) / lens->fy_px);
        if (!(off < off_most))
            return fail(err, ERROR_DATA, "the lens's distortion has no inverse at %.1f, %.1f",
                        px[i][0], px[i][1]);
    }
    return true;
}

bool is_quadrilateral(const std::vector<cv::Point> &contour, double corner_px[4][2], double *fill)
{
    std::vector<cv::Point> four;
    double around = cv::arcLength(contour, true);
    for (double share = 0.005; share < 0.06 && four.size() != 4; share *= 1.2)
        cv::approxPolyDP(contour, four, share * around, true);
    if (four.size() != 4 || !cv::isContourConvex(four))
        return false;
    double area = cv::contourArea(four);
    if (cv::contourArea(four, true) < 0) // y points down: positive is clockwise as seen
        std::reverse(four.begin(), four.end());
    *fill = area > 0 ? cv::contourArea(contour) / area : 0;
    for (int i = 0; i < 4; i++) {
        corner_px[i][0] = four[i].x;
        corner_px[i][1] = four[i].y;
    }
    return true;
}

} // namespace

bool hdr_response(enum hdr_method method, const uint8_t *codes, const double *seconds, int frames,
                  int pixels, double response[HDR_CODES], struct error *err)
{
    try {
        std::vector<float> times(seconds, seconds + frames);
        cv::Mat found = find(method, frames_of(codes, frames, pixels), times, pixels);
        int told = 0;
        for (int z = 0; z < HDR_CODES; z++) {
            double value = found.at<cv::Vec3f>(z)[0];
            bool sound = std::isfinite(value) && value > 0;
            response[z] = sound ? value : 0;
            told += sound;
        }
        if (told < told_least)
            return fail(err, ERROR_DATA, "the pictures tell the response at %d codes only", told);
        return true;
    } catch (const std::exception &e) {
        return fail(err, ERROR_DATA, "OpenCV: %s", e.what());
    }
}

bool hdr_distort(const struct hdr_lens *lens, const double (*tangent)[2], int count,
                 double (*px)[2], struct error *err)
{
    try {
        if (count > 0)
            distort(lens, tangent, count, px);
        return true;
    } catch (const std::exception &e) {
        return fail(err, ERROR_DATA, "OpenCV: %s", e.what());
    }
}

bool hdr_undistort(const struct hdr_lens *lens, const double (*px)[2], int count,
                   double (*tangent)[2], struct error *err)
{
    try {
        std::vector<cv::Point2d> seen, ideal;
        cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-12);
        for (int i = 0; i < count; i++)
            seen.emplace_back(px[i][0], px[i][1]);
        if (count > 0)
            cv::undistortPoints(seen, ideal, camera_of(lens), distortion_of(lens), cv::noArray(),
                                cv::noArray(), until);
        for (int i = 0; i < count; i++) {
            tangent[i][0] = ideal[i].x;
            tangent[i][1] = ideal[i].y;
        }
        return came_back(lens, px, count, tangent, err);
    } catch (const std::exception &e) {
        return fail(err, ERROR_DATA, "OpenCV: %s", e.what());
    }
}

bool hdr_quadrilateral(const uint8_t *mask, int width, int height, int seed_x, int seed_y,
                       double corner_px[4][2], double *fill)
{
    try {
        cv::Mat all(height, width, CV_8UC1, const_cast<uint8_t *>(mask));
        cv::Mat piece = cv::Mat::zeros(height + 2, width + 2, CV_8UC1);
        cv::Rect box;
        if (!mask[static_cast<size_t>(seed_y) * width + seed_x])
            return false;
        cv::floodFill(all, piece, {seed_x, seed_y}, 1, &box, 0, 0,
                      4 | (255 << 8) | cv::FLOODFILL_MASK_ONLY);
        if (box.x <= 0 || box.y <= 0 || box.br().x >= width || box.br().y >= height)
            return false;
        std::vector<std::vector<cv::Point>> contours;
        cv::findContours(piece(cv::Rect(1, 1, width, height)).clone(), contours, cv::RETR_EXTERNAL,
                         cv::CHAIN_APPROX_NONE);
        return contours.size() == 1 && is_quadrilateral(contours[0], corner_px, fill);
    } catch (const std::exception &) {
        return false;
    }
}
