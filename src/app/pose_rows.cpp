#include "app/pose_rows.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>

#include <ist/error.h>

namespace ist::app {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\"");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\"") - first + 1);
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    fields.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return fields;
}

/// Any number that the C locale writes, nan and inf included: judging a pose is the query's part.
std::optional<double> number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Where the columns stand in a file.
struct Header {
  static constexpr std::array kPose = {"qw", "qx", "qy", "qz", "tx", "ty", "tz"};

  std::vector<std::string> names;

  std::optional<std::size_t> find(std::string_view name) const {
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i] == name) return i;
    return std::nullopt;
  }
};

void set_component(Pose& pose, std::size_t k, double value) {
  (k < 4 ? pose.q[k] : pose.t[k - 4]) = value;
}

}  // namespace

Pose parse_pose(const std::string& text) {
  const std::vector<std::string_view> fields = split(text);
  Pose pose;
  for (std::size_t k = 0; k < fields.size() || k < 7; ++k) {
    const std::optional<double> value =
        k < fields.size() && fields.size() == 7 ? number(fields[k]) : std::nullopt;
    if (!value)
      throw Error("'" + text + "' is not a pose; write seven numbers qw,qx,qy,qz,tx,ty,tz");
    set_component(pose, k, *value);
  }
  return pose;
}

std::vector<PoseRow> read_pose_rows(const std::filesystem::path& path, double scale_b) {
  std::ifstream file(path);
  if (!file)
    throw Error(path.string() + ": cannot open: " + std::generic_category().message(errno));
  std::string line;
  if (!std::getline(file, line)) throw Error(path.string() + ": cannot read a header row");
  if (line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);  // the mark of UTF-8, as Excel writes
  Header header;
  for (const std::string_view name : split(line)) header.names.emplace_back(name);
  for (const char* name : Header::kPose)
    if (!header.find(name))
      throw Error(fmt::format("{}: no column '{}'; the header row must name qw,qx,qy,qz,tx,ty,tz",
                              path.string(), name));
  const auto id = header.find("id"), label = header.find("class"), scale = header.find("scale_b");

  std::vector<PoseRow> rows;
  for (std::size_t line_number = 2; std::getline(file, line); ++line_number) {
    if (trimmed(line).empty()) continue;
    const std::vector<std::string_view> fields = split(line);
    const auto fail = [&](const std::string& what) {
      throw Error(fmt::format("{}:{}: {}", path.string(), line_number, what));
    };
    if (fields.size() != header.names.size())
      fail(fmt::format("{} fields, but the header has {}", fields.size(), header.names.size()));
    const auto value = [&](std::size_t column) {
      const std::optional<double> result = number(fields[column]);
      if (!result)
        fail(fmt::format("'{}' in column '{}' is not a number", fields[column],
                         header.names[column]));
      return *result;
    };
    PoseRow row;
    row.id = id ? std::string(fields[*id]) : std::to_string(rows.size());
    if (label) row.label = fields[*label];
    for (std::size_t k = 0; k < Header::kPose.size(); ++k)
      set_component(row.pose, k, value(*header.find(Header::kPose[k])));
    row.scale_b = scale ? value(*scale) : scale_b;
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace ist::app
