#pragma once

#include <ist/query.h>
#include <string>
#include <vector>

namespace ist::app {

/// One query: x_A = R (scale_b · x_B) + t.
struct PoseRow {
  std::string id, label;  ///< columns `id` and `class`, free text
  Pose pose;
  double scale_b = 1;
};

struct PoseTable {
  std::vector<PoseRow> rows;
  bool has_labels = false, has_scales = false;  ///< true if columns `class`, `scale_b` exist
};

/// "qw,qx,qy,qz,tx,ty,tz". Throws Error.
Pose parse_pose(const std::string& text);

/// Reads a CSV, "-" from standard input, with at least the columns qw,qx,qy,qz,tx,ty,tz; id (else
/// the row's number), class and scale_b (else 1) are optional, other columns are ignored. Throws
/// Error that names the line; also for duplicate columns, columns spelled almost like one of these,
/// and a file without rows.
PoseTable read_pose_table(const std::string& path);

/// The invalid number of a row that a query rejects, and the reason.
std::string pose_fault(const PoseRow& row);

struct Answer {
  PoseRow row;
  PenetrationAndSeparation result;
  double time_us = 0;     ///< [µs] wall time of this one query
  bool surfaces = false;  ///< the distance is between surfaces, else between inner spheres
  bool exact = false;     ///< by the exact measure, which detects touching

  /// Mesh-only assets have no distance of spheres.
  bool has_distance() const { return result.separation.status != QueryStatus::missing_data; }
  /// The more severe status of the parts that were queried.
  QueryStatus status() const {
    const QueryStatus overlap = result.penetration.status, gap = result.separation.status;
    if (!has_distance()) return overlap;
    return overlap == QueryStatus::error_exceeded && gap != QueryStatus::ok
               ? gap
               : std::max(overlap, gap);
  }
  std::uint64_t node_visits() const;
  std::uint64_t sphere_pairs() const;
};

// The columns of docs/user_guide.md (*Query*), 17 digits. Other tools read them: append only.
std::string answers_csv(std::span<const Answer> answers);
std::string answers_json(std::span<const Answer> answers);

std::string answer_text(const Answer& answer, const PenetrationSettings& settings);

}  // namespace ist::app
