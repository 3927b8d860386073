#include "app/pose_rows.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <iostream>
#include <optional>
#include <sstream>
#include <string_view>
#include <system_error>

#include <ist/error.h>

#include "app/csv_reader.h"
#include "library/settings/numbers.h"

namespace ist::app {
namespace {

constexpr std::array kPose = {"qw", "qx", "qy", "qz", "tx", "ty", "tz"};

double& component(Pose& pose, std::size_t k) { return k < 4 ? pose.q[k] : pose.t[k - 4]; }

/// Without what spellings differ in: "Scale B" and "scale_b" are one.
std::string plain(const std::string& name) {
  std::string result;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      result += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

/// Where a column stands. One that is there twice, or in another spelling, is an error: to pass it
/// over would answer another question than was asked.
std::optional<std::size_t> find_column(const std::vector<std::string>& header,
                                       const std::string& name, const CsvReader& file) {
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (plain(header[i]) != plain(name)) continue;
    if (header[i] != name)
      file.fail(
          fmt::format("column '{}' must be spelled '{}'; if it means something else, rename it",
                      header[i], name));
    if (found) file.fail(fmt::format("column '{}' appears twice", name));
    found = i;
  }
  return found;
}

/// Column numbers.
struct Columns {
  std::array<std::size_t, kPose.size()> pose;
  std::optional<std::size_t> id, label, scale;

  Columns(const std::vector<std::string>& header, const CsvReader& file)
      : id(find_column(header, "id", file)),
        label(find_column(header, "class", file)),
        scale(find_column(header, "scale_b", file)) {
    for (std::size_t k = 0; k < kPose.size(); ++k) {
      const std::optional<std::size_t> column = find_column(header, kPose[k], file);
      if (!column)
        file.fail(fmt::format("no column '{}'; the header row must contain qw,qx,qy,qz,tx,ty,tz",
                              kPose[k]));
      pose[k] = *column;
    }
  }
};

PoseTable read(std::istream& text, const std::string& name) {
  CsvReader file(text, name);
  std::vector<std::string> header, fields;
  if (!file.next(header)) throw Error(name + ": is empty; the first row must be the header");
  const Columns columns(header, file);
  PoseTable table{{}, columns.label.has_value(), columns.scale.has_value()};
  while (file.next(fields)) {
    if (fields.size() != header.size())
      file.fail(fmt::format("{} fields, but the header has {}", fields.size(), header.size()));
    // nan and inf are numbers here: judging a pose is the query's part.
    const auto number = [&](std::size_t column) {
      const std::optional<double> value = parse_number(fields[column]);
      if (!value)
        file.fail(
            fmt::format("'{}' in column '{}' is not a number", fields[column], header[column]));
      return *value;
    };
    PoseRow row;
    row.id = columns.id ? fields[*columns.id] : std::to_string(table.rows.size());
    if (columns.label) row.label = fields[*columns.label];
    for (std::size_t k = 0; k < kPose.size(); ++k) component(row.pose, k) = number(columns.pose[k]);
    if (columns.scale) row.scale_b = number(*columns.scale);
    table.rows.push_back(std::move(row));
  }
  if (text.bad()) throw Error(name + ": reading failed before the end");
  if (table.rows.empty()) throw Error(name + ": no rows after the header");
  return table;
}

}  // namespace

Pose parse_pose(const std::string& text) {
  std::istringstream line(text);
  std::vector<std::string> fields;
  CsvReader(line, text).next(fields);
  if (fields.size() != kPose.size())
    throw Error(fmt::format("'{}' is not a pose; write seven numbers qw,qx,qy,qz,tx,ty,tz", text));
  Pose pose;
  for (std::size_t k = 0; k < kPose.size(); ++k) {
    const std::optional<double> value = parse_number(fields[k]);
    if (!value)
      throw Error(
          fmt::format("'{}' is not a pose: {} = '{}' is not a number; write seven numbers "
                      "qw,qx,qy,qz,tx,ty,tz",
                      text, kPose[k], fields[k]));
    component(pose, k) = *value;
  }
  return pose;
}

PoseTable read_pose_table(const std::string& path) {
  if (path == "-") return read(std::cin, "standard input");
  std::ifstream file(path);
  if (!file) throw Error(path + ": cannot open: " + std::generic_category().message(errno));
  return read(file, path);
}

std::string pose_fault(const PoseRow& row) {
  Pose pose = row.pose;
  for (std::size_t k = 0; k < kPose.size(); ++k)
    if (!std::isfinite(component(pose, k)))
      return fmt::format("{} is {}, not a finite number", kPose[k], component(pose, k));
  if (!(row.scale_b > 0) || !std::isfinite(row.scale_b))
    return fmt::format("scale_b is {}, not a finite number above 0", row.scale_b);
  const double* const q = pose.q;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 0)) return "the quaternion qw,qx,qy,qz has length 0";
  std::string name = "scale_b";
  double worst = row.scale_b, size = std::max(row.scale_b, 1 / row.scale_b);
  for (std::size_t k = 4; k < kPose.size(); ++k)
    if (const double value = component(pose, k); std::abs(value) > size)
      name = kPose[k], worst = value, size = std::abs(value);
  return fmt::format(
      "{} is {:g}, out of range: sizes and distances may differ by a factor of at most 1e60", name,
      worst);
}

}  // namespace ist::app
