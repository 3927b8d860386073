#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <ist/pose.h>

namespace ist::app {

/// One question to ask: x_A = R (scale_b · x_B) + t.
struct PoseRow {
  std::string id, label;  ///< columns `id` and `class`, free text
  Pose pose;
  double scale_b = 1;
};

/// "qw,qx,qy,qz,tx,ty,tz". Throws Error.
Pose parse_pose(const std::string& text);

/// Reads a CSV with at least the columns qw,qx,qy,qz,tx,ty,tz; id (else the row's number), class
/// and scale_b (else `scale_b`) are taken where they stand, further columns are ignored. Throws
/// Error that names the line.
std::vector<PoseRow> read_pose_rows(const std::filesystem::path& path, double scale_b);

}  // namespace ist::app
