#include "app/sphere_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>

#include <ist/error.h>

#include "app/glb_scene.h"
#include "app/options.h"
#include "library/text.h"
#include "robot/kinematics.h"

namespace ist::app {
namespace {

using Json = nlohmann::ordered_json;

/// Of a link's file: beside capsules those of the description alone.
const std::vector<CoverSphere>& spheres_of(const SphereLink& link) {
  return link.capsules.empty() ? link.cover.spheres : link.given;
}

Json link_json(const SphereLink& link, const SelfCollision& self) {
  const SphereProtrusion& p = link.cover.protrusion;
  Json spheres = Json::array(), capsules = Json::array();
  for (const CoverSphere& s : spheres_of(link))
    spheres.push_back({s.centre.x(), s.centre.y(), s.centre.z(), s.radius});
  for (const auto& [a, b, radius] : link.capsules)
    capsules.push_back({a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), radius});
  return {{"spheres", spheres},
          {"capsules", capsules},
          {"protrusion", p.largest},
          {"protrusion_mean", p.mean},
          {"protrusion_p95", p.p95},
          {"volume_ratio", link.has_mesh ? Json(p.volume_ratio) : nullptr},
          {"covered", link.proof.covered},
          {"self_collision_buffer", self.buffer(link.name)}};
}

Json robot_json(const SphereRobot& robot) {
  Json links = Json::object();
  for (const SphereLink& link : robot.links) links[link.name] = link_json(link, robot.self);
  Json ignored = Json::array();
  for (const IgnoredPair& pair : robot.self.ignored)
    ignored.push_back({{"links", {pair.a, pair.b}}, {"reason", pair.reason}});
  return {{"robot", robot.name},
          {"links", links},
          {"self_collision",
           {{"pairs", robot.self.pairs}, {"ignored", ignored}, {"samples", robot.self.samples}}}};
}

/// Links and spheres, each a node, in the default pose. glTF's Y is up, a robot's Z.
std::string robot_glb(const SphereRobot& robot) {
  const double half = std::numbers::sqrt2 / 2;
  GlbScene scene(GlbScene::Json{{"name", robot.name}, {"rotation", {-half, 0, 0, half}}});
  const std::size_t ball = scene.add_ball("spheres", {0.90, 0.45, 0.15, 0.35});
  const auto frames = link_frames(robot.robot, default_positions(robot.robot));
  std::size_t mesh = 0;
  for (const SphereLink& link : robot.links) {
    const auto at = std::find_if(robot.robot.links.begin(), robot.robot.links.end(),
                                 [&](const RobotLink& one) { return one.name == link.name; });
    const Eigen::Isometry3d& frame =
        frames[static_cast<std::size_t>(at - robot.robot.links.begin())];
    const Eigen::Quaterniond q(frame.linear());
    const Eigen::Vector3d t = frame.translation();
    const std::size_t node = scene.add_node(0, {{"name", link.name},
                                                {"rotation", {q.x(), q.y(), q.z(), q.w()}},
                                                {"translation", {t.x(), t.y(), t.z()}}});
    if (link.has_mesh) {
      const TriangleMesh& triangles = robot.meshes[mesh++].mesh;
      scene.add_node(node, {{"name", link.name + " mesh"},
                            {"mesh", scene.add_mesh(link.name, {0.55, 0.57, 0.60, 1.0},
                                                    triangles.vertices, triangles.triangles)}});
    }
    const std::size_t group = scene.add_node(node, {{"name", link.name + " spheres"}});
    for (const CoverSphere& s : link.cover.spheres)
      scene.add_instance(group, ball, s.centre, s.radius);
  }
  return scene.bytes();
}

std::string robot_yaml(const SphereRobot& robot) {
  if (!robot.is_robot()) return curobo_spheres(robot.spheres());
  return curobo_robot(robot.robot, std::filesystem::absolute(robot.input).string(), robot.spheres(),
                      robot.self);
}

}  // namespace

std::vector<LinkSpheres> SphereRobot::spheres() const {
  std::vector<LinkSpheres> out;
  for (const SphereLink& link : links)
    out.push_back({link.name, spheres_of(link), link.cover.protrusion.largest, link.capsules});
  return out;
}

SphereWriter sphere_writer(const std::string& output) {
  const std::string ending = ending_of(output);
  if (ending == ".json")
    return [](const SphereRobot& r) { return json_text(robot_json(r), 1) + "\n"; };
  if (ending == ".yml" || ending == ".yaml") return robot_yaml;
  if (ending == ".glb") return robot_glb;
  if (ending == ".xrdf")
    return [](const SphereRobot& r) { return xrdf(r.robot, r.spheres(), r.self); };
  if (ending == ".srdf")
    return [](const SphereRobot& r) { return srdf(r.robot, r.spheres(), r.self); };
  if (ending == ".urdf")
    return [](const SphereRobot& r) {
      return r.is_robot() ? urdf_with_spheres(r.robot, r.spheres())
                          : urdf_of_spheres(r.spheres()[0]);
    };
  throw Error(output + ": unknown format '" + ending +
              "'; use .urdf, .yml, .xrdf, .srdf, .glb or .json");
}

std::string spheres_report_json(const SphereRobot& robot, const std::string& output,
                                double seconds) {
  Json result = {{"output", output}, {"input", robot.input}};
  result.update(robot_json(robot));
  for (const SphereLink& link : robot.links) {
    auto& entry = result["links"][link.name];
    entry["spheres"] = spheres_of(link).size();
    entry["capsules"] = link.capsules.size();
    entry["seconds"] = link.cover.seconds;
  }
  result["seconds"] = seconds;
  return json_text(result) + "\n";
}

std::string spheres_table(const SphereRobot& robot, const std::string& output, double seconds) {
  const auto count_of = [](const SphereLink& link) {
    return spheres_of(link).size() + link.capsules.size();
  };
  std::size_t width = 5, count = 0;
  double largest = 0;
  for (const SphereLink& link : robot.links) width = std::max(width, link.name.size());
  std::string out = fmt::format("{}\n  {:<{}} {:>7} {:>8} {:>10} {:>10} {:>10} {:>7} {:>7}\n",
                                output, "link", width, robot.has_capsules() ? "shapes" : "spheres",
                                "covered", "mean [u]", "p95 [u]", "max [u]", "volume", "time");
  for (const SphereLink& link : robot.links) {
    const SphereProtrusion& p = link.cover.protrusion;
    out +=
        fmt::format("  {:<{}} {:>7} {:>8} {:>10.4g} {:>10.4g} {:>10.4g} {:>7.3f} {:>5.2f} s\n",
                    link.name, width, count_of(link), link.proof.covered ? "proven" : "no", p.mean,
                    p.p95, p.largest, link.has_mesh ? p.volume_ratio : 1.0, link.cover.seconds);
    count += count_of(link);
    largest = std::max(largest, p.largest);
  }
  if (robot.links.size() > 1)
    out += fmt::format("  {:<{}} {:>7} {:>8} {:>10} {:>10} {:>10.4g}\n", "total", width, count, "",
                       "", "", largest);
  if (robot.self.pairs > 0)
    out += fmt::format(
        "  self-collision: {} of {} pairs of links are ignored, {} links have a "
        "buffer\n",
        robot.self.ignored.size(), robot.self.pairs, robot.self.buffers.size());
  return out + fmt::format("  time {:.2f} s\n", seconds);
}

}  // namespace ist::app
