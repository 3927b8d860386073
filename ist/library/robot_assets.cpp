#include "library/robot_assets.h"

#include <fmt/format.h>
#include <ist/types.h>
#include <algorithm>
#include <cstdlib>

#include "library/settings/spelling.h"

namespace ist {
namespace {

using Json = nlohmann::ordered_json;

/// The description of a primitive, in the syntax of parse_field().
std::string field_spec_of(const LinkShape& shape) {
  if (const auto* box = std::get_if<LinkBox>(&shape))
    return fmt::format("box:{:.17g},{:.17g},{:.17g}", box->half_extents.x(), box->half_extents.y(),
                       box->half_extents.z());
  if (const auto* cylinder = std::get_if<LinkCylinder>(&shape))
    return fmt::format("cylinder:{:.17g},{:.17g}", cylinder->radius, cylinder->half_height);
  if (const auto* capsule = std::get_if<LinkCapsule>(&shape))
    return fmt::format("capsule:{:.17g},{:.17g}", capsule->radius, capsule->half_height);
  if (std::holds_alternative<LinkEllipsoid>(shape))
    throw Error(
        "an ellipsoid is no field of a query. Leave its link out with --skip, or give a mesh");
  return fmt::format("ball:{:.17g}", std::get<LinkBall>(shape).radius);
}

Json pose_json(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) {
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}

bool equal(const PlacedLinkShape& a, const PlacedLinkShape& b) {
  const LinkMesh &m = std::get<LinkMesh>(a.shape), &n = std::get<LinkMesh>(b.shape);
  return m.file == n.file && m.scale == n.scale && a.rotation.coeffs() == b.rotation.coeffs() &&
         a.translation == b.translation;
}

}  // namespace

RobotModel read_robot_for(const RobotOptions& options, const std::string& input) {
  RobotModel robot = read_robot(input);
  for (const auto* names : {&options.skipped, &options.repaired})
    for (const std::string& name : *names) require_link(robot, name);
  bool any = false;
  for (RobotLink& link : robot.links) {
    if (std::count(options.skipped.begin(), options.skipped.end(), link.name) != 0) {
      link.collision.clear();
      link.visual.clear();
    }
    any = any || !link.shapes(options.shapes()).empty();
    for (const PlacedLinkShape& placed : link.shapes(options.shapes()))
      if (const auto* fault = std::get_if<LinkFault>(&placed.shape)) throw Error(fault->what);
  }
  if (any) return robot;
  throw Error(input + (options.visual
                           ? ": no link has a visual shape"
                           : ": no link has a collision shape; --visual uses the visual shapes"));
}

std::vector<std::string> links_seen_only(const RobotModel& robot, const RobotOptions& options) {
  std::vector<std::string> names;
  for (const RobotLink& link : robot.links)
    if (!options.visual && link.collision.empty() && !link.visual.empty())
      names.push_back(link.name);
  return names;
}

void require_link(const RobotModel& robot, const std::string& name) {
  std::vector<std::string> names;
  for (const RobotLink& link : robot.links) names.push_back(link.name);
  if (std::count(names.begin(), names.end(), name) != 0) return;
  const std::string nearest = nearest_word(name, names);
  throw Error(fmt::format("{}: no link is called '{}'{}", robot.file.path, name,
                          nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
}

PackagePaths package_paths(const std::string& urdf, const RobotOptions& options) {
  const char* const ros_path = std::getenv("ROS_PACKAGE_PATH");
  return {urdf, options.packages, ros_path == nullptr ? "" : ros_path};
}

std::string file_name_of(const std::string& name) {
  std::string out;
  for (const char c : name)
    out += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
                   c == '-' || (c == '.' && !out.empty())
               ? c
               : '_';
  return out.empty() ? "robot" : out;
}

RobotAssets robot_assets(const RobotModel& robot, LinkShapes which, const std::string& prefix,
                         const Job& like) {
  RobotAssets out;
  out.name = file_name_of(robot.name);
  const auto asset_of = [&](const RobotLink& link, const PlacedLinkShape& shape) {
    const auto known = std::find_if(out.jobs.begin(), out.jobs.end(),
                                    [&](const Job& job) { return equal(*job.shape, shape); });
    if (known != out.jobs.end()) {
      out.links[static_cast<std::size_t>(known - out.jobs.begin())].push_back(link.name);
      return known->name;
    }
    const std::string base = prefix + file_name_of(link.name);
    Job job = like;
    job.name = base;
    for (int k = 1; std::any_of(out.jobs.begin(), out.jobs.end(),
                                [&](const Job& one) { return one.name == job.name; });
         ++k)
      job.name = fmt::format("{}_{}", base, k);
    job.mesh = std::get<LinkMesh>(shape.shape).file;
    job.shape = shape;
    job.urdf = robot.file.path;
    out.links.push_back({link.name});
    return out.jobs.emplace_back(std::move(job)).name;
  };
  Json links = Json::object();
  for (const RobotLink& link : robot.links) {
    Json& shapes = links[link.name] = Json::array();
    for (const PlacedLinkShape& shape : link.shapes(which))
      if (std::holds_alternative<LinkMesh>(shape.shape))  // the asset is in the link's frame
        shapes.push_back(
            {{"asset", asset_of(link, shape) + ".ist"},
             {"pose", pose_json(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero())}});
      else
        try {
          shapes.push_back({{"field", field_spec_of(shape.shape)},
                            {"pose", pose_json(shape.rotation, shape.translation)}});
        } catch (const Error& error) {
          throw Error(fmt::format("{}: link {}: {}", robot.file.path, link.name, error.what()));
        }
  }
  out.index = {{"robot", robot.name}, {"links", links}};
  return out;
}

}  // namespace ist
