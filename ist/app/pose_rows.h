#pragma once

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

struct PoseTable {
  std::vector<PoseRow> rows;
  bool has_labels = false, has_scales = false;  ///< whether there are columns `class`, `scale_b`
};

/// "qw,qx,qy,qz,tx,ty,tz". Throws Error.
Pose parse_pose(const std::string& text);

/// Reads a CSV, "-" from standard input, with at least the columns qw,qx,qy,qz,tx,ty,tz; id (else
/// the row's number), class and scale_b (else 1) are taken where they stand, further columns are
/// ignored. Throws Error that names the line; so do columns that are there twice or spelled almost
/// like one of these, and a file without rows.
PoseTable read_pose_table(const std::string& path);

/// Which of the row's numbers is at fault, and why, where a query calls it invalid.
std::string pose_fault(const PoseRow& row);

}  // namespace ist::app
