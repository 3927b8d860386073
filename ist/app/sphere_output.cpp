#include "app/sphere_output.h"

#include <fmt/format.h>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>

#include "app/glb_scene.h"
#include "app/mesh_notes.h"
#include "app/options.h"
#include "library/text.h"
#include "robots/description/kinematics.h"

namespace ist::app {
namespace {

using Json = nlohmann::ordered_json;

/// The spheres for a link's file; with capsules, only those of the description.
const std::vector<CoverSphere>& spheres_of(const SphereLink& link) {
  return link.capsules.empty() ? link.cover.spheres : link.given;
}

/// How an open link was closed; method "capsule": it could not be.
Json link_closing_json(const SphereLink& link) {
  Json json = closing_json(link.closing);
  if (link.bounding_capsule) json["method"] = "capsule";
  return json;
}

/// Unknown numbers become null.
Json number_or_null(double x) { return std::isfinite(x) ? Json(x) : Json(); }

Json link_json(const SphereLink& link) {
  const SphereProtrusion& p = link.cover.protrusion;
  Json spheres = Json::array(), capsules = Json::array();
  for (const CoverSphere& s : spheres_of(link))
    spheres.push_back({s.centre.x(), s.centre.y(), s.centre.z(), s.radius});
  for (const auto& [a, b, radius] : link.capsules)
    capsules.push_back({a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), radius});
  return {{"spheres", spheres},
          {"capsules", capsules},
          {"protrusion", number_or_null(p.largest)},
          {"protrusion_mean", number_or_null(p.mean)},
          {"protrusion_p95", number_or_null(p.p95)},
          {"volume_ratio", link.has_mesh ? number_or_null(p.volume_ratio) : nullptr},
          {"covered", link.proof.covered},
          {"covered_by", !link.proof.covered     ? Json()
                         : link.capsules.empty() ? Json("spheres")
                         : link.given.empty()    ? Json("capsules")
                                                 : Json("capsules and spheres")},
          {"closing", link_closing_json(link)},
          {"self_collision_buffer", 0.0}};
}

Json robot_json(const SphereRobot& robot) {
  Json links = Json::object();
  for (const SphereLink& link : robot.links) links[link.name] = link_json(link);
  const SelfCollision& self = robot.self;
  Json ignored = Json::array(), wrong = Json::array(), too_close = Json::array(),
       mostly = Json::array();
  for (const ClosePair& pair : robot.too_close)
    too_close.push_back({{"links", {pair.a, pair.b}},
                         {"gap", pair.gap},
                         {"protrusion", pair.gap / 2},
                         {"spheres", pair.spheres}});
  for (const LinkPair& pair : self.pairs) {
    if (!pair.ignored.empty())
      ignored.push_back({{"links", {pair.a, pair.b}},
                         {"reason", pair.ignored},
                         {"tried", pair.tried},
                         {"colliding", pair.is_counted() ? Json(pair.colliding) : Json()}});
    if (self.is_mostly_colliding(pair))
      mostly.push_back({{"links", {pair.a, pair.b}}, {"colliding", pair.colliding}});
    if (pair.missed + pair.falsely > 0)
      wrong.push_back({{"links", {pair.a, pair.b}},
                       {"colliding", pair.colliding},
                       {"missed", pair.missed},
                       {"false", pair.falsely}});
  }
  Json positions = Json::object(), overlapping = Json::array(), locked = Json::array();
  for (const auto& [joint, position] : self.locked)
    locked.push_back(robot.robot.joints[joint].name);
  for (std::size_t j = 0; j < self.pose.positions.size(); ++j)
    if (robot.robot.joints[j].is_free())
      positions[robot.robot.joints[j].name] = self.pose.positions[j];
  for (const auto& [a, b] : self.pose.overlapping) overlapping.push_back({a, b});
  return {{"robot", robot.name},
          {"links", links},
          {"left_out", robot.left_out},
          {"taken_as_fixed", robot.taken_as_fixed},
          {"default_pose",
           {{"positions", positions},
            {"from", self.pose.from},
            {"links_free", self.pose.solids_free},
            {"spheres_free", self.pose.overlapping.empty()},
            {"overlapping", overlapping},
            {"locked", locked}}},
          {"self_collision",
           {{"pairs", self.pairs.size()},
            {"ignored", ignored},
            {"samples", self.samples},
            {"colliding", self.colliding},
            {"missed", self.missed},
            {"false", self.falsely},
            {"wrong", wrong},
            {"mostly_colliding", mostly},
            {"too_close", too_close}}}};
}

/// Links and spheres, each a node, in the default pose. glTF's Y is up, a robot's Z.
std::string robot_glb(const SphereRobot& robot) {
  const double half = std::numbers::sqrt2 / 2;
  GlbScene scene(GlbScene::Json{{"name", robot.name}, {"rotation", {-half, 0, 0, half}}});
  const std::size_t ball = scene.add_ball("spheres", {0.90, 0.45, 0.15, 0.35});
  const auto frames = link_frames(robot.robot, robot.self.pose.positions);
  std::size_t mesh = 0;
  for (const SphereLink& link : robot.links) {
    const Eigen::Isometry3d& frame = frames[index_named(robot.robot.links, link.name)];
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
  namespace fs = std::filesystem;
  const fs::path folder = fs::absolute(robot.output).lexically_normal().parent_path();
  const fs::path urdf = fs::absolute(robot.input).lexically_normal().lexically_relative(folder);
  return curobo_robot(robot.robot, urdf.generic_string(), robot.spheres(), robot.self);
}

/// Describes the pairs that planners should ignore, and how accurate that is.
std::string self_collision_text(const SphereRobot& robot) {
  const SelfCollision& self = robot.self;
  std::map<std::string, std::size_t> ignored;
  std::vector<const LinkPair*> wrong;
  for (const LinkPair& pair : self.pairs) {
    if (!pair.ignored.empty()) ++ignored[pair.ignored];
    if (pair.missed + pair.falsely > 0) wrong.push_back(&pair);
  }
  const LinkPair* excluded = nullptr;  // the pair that overlaps most often
  std::size_t overlapping = 0;
  for (const LinkPair& pair : self.pairs) {
    if (pair.ignored != "Excluded" || pair.colliding == 0) continue;
    ++overlapping;
    if (excluded == nullptr || pair.colliding > excluded->colliding) excluded = &pair;
  }
  std::string reasons;
  for (const auto& [reason, count] : ignored)
    reasons += fmt::format("{}{} {}", reasons.empty() ? "" : ", ", count, reason);
  std::string out = fmt::format("  self-collision: {} pairs of links, ignored: {}\n",
                                self.pairs.size(), reasons.empty() ? "none" : reasons);
  out += fmt::format(
      "    in {} sampled poses: of {} truly colliding {} are called free, of {} free ones {} "
      "({:.1f} %) are called colliding\n",
      self.samples, self.colliding, self.missed, self.samples - self.colliding, self.falsely,
      100 * self.false_share());
  if (excluded != nullptr)
    out += fmt::format(
        "    excluded pairs that overlap in some of them, which counts as no collision: {}, most "
        "often {} and {}, in {}\n",
        overlapping, excluded->a, excluded->b, excluded->colliding);
  std::sort(wrong.begin(), wrong.end(), [](const LinkPair* a, const LinkPair* b) {
    return std::pair(a->missed, a->falsely) > std::pair(b->missed, b->falsely);
  });
  constexpr std::size_t kShown = 4;
  for (std::size_t i = 0; i < std::min(kShown, wrong.size()); ++i)
    out += fmt::format("    {} and {}: collide in {}, missed in {}, falsely in {}\n", wrong[i]->a,
                       wrong[i]->b, wrong[i]->colliding, wrong[i]->missed, wrong[i]->falsely);
  for (const ClosePair& pair : robot.too_close)
    out += fmt::format(
        "    {} and {} pass at {:.3g}: spheres that protrude by at most {:.3g} there would tell, "
        "about "
        "{} of both links\n",
        pair.a, pair.b, pair.gap, pair.gap / 2, pair.spheres);
  std::string locked;
  for (const auto& [joint, position] : self.locked)
    locked += fmt::format("{}{} at {:g}", locked.empty() ? "; gripper locked: " : ", ",
                          robot.robot.joints[joint].name, position);
  return out + fmt::format("  default pose: {}, {}{}\n", self.pose.from,
                           self.pose.overlapping.empty() ? "free"
                           : self.pose.solids_free ? "where spheres of different links overlap"
                                                   : "where links overlap",
                           locked);
}

}  // namespace

std::vector<LinkSpheres> SphereRobot::spheres() const {
  std::vector<LinkSpheres> out;
  for (const SphereLink& link : links)
    out.push_back({link.name, spheres_of(link), link.cover.protrusion.largest, link.capsules});
  return out;
}

std::vector<LinkSpheres> SphereRobot::covers() const {
  std::vector<LinkSpheres> out = spheres();
  for (std::size_t i = 0; i < out.size(); ++i) out[i].spheres = links[i].cover.spheres;
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
      return r.is_robot()
                 ? urdf_with_spheres(r.robot, r.spheres(),
                                     std::filesystem::absolute(r.output).parent_path().string())
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
  for (const SphereLink& link : robot.links)
    if (!link.capsules.empty() && !link.given.empty())
      out += fmt::format("  {}: its capsules and its {} spheres cover it together\n", link.name,
                         link.given.size());
  for (const SphereLink& link : robot.links) {
    const std::string how =
        link.bounding_capsule ? "a bounding capsule stands for it" : describe_closing(link.closing);
    if (how.empty()) continue;
    out += fmt::format("  {} was not closed: {}", link.name, how);
    if (link.closing.judged)
      out += fmt::format("; it deviates by up to {:.4g}", link.closing.judged->input_max);
    out += "; the proof includes the mesh as read\n";
  }
  if (!robot.self.pairs.empty()) out += self_collision_text(robot);
  return out + fmt::format("  time {:.2f} s\n", seconds);
}

}  // namespace ist::app
