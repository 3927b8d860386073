// Contact, distance and force beside FCL, Bullet and the exact answers: every row of the oracle,
// and random poses over pairs of development meshes. What must hold stands in
// support/contact_oracle.h.

#include "support/contact_oracle.h"

#include <cstdio>

#include "report.h"
#include "timing.h"

namespace {

using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::testing::ContactCase;
using ist::testing::ContactVerdict;

struct MeshPair {
  const char *name, *a, *b;
  double size_b;  ///< B's diagonal over A's
};

/// Meshes of one component that do not cross themselves.
constexpr MeshPair kMeshPairs[] = {
    {"spot, torus", "spot.obj", "torus.off", 1.2},
    {"mug, spot", "mug.ply", "spot.obj", 0.3},
    {"hole tray, peg", "hole_tray_round_16mm.obj", "peg_round_16mm.obj", 0.9},
    {"bolt, nut", "bolt_gen.ply", "nut_gen.ply", 0.6},
    {"cube, cube", "unit_cube.stl", "unit_cube.stl", 1},
    {"Menger sponge, torus", "menger_sponge3.glb", "torus.off", 0.5},
    {"tray, sword", "tray_perforated.stl", "sword.ply", 0.5},
    {"ADIS16480, spot", "adis16480.stl", "spot.obj", 0.8},
    {"bunny, spot", "bunny_60k.ply", "spot.obj", 0.7},
};

/// What is counted over the cases of one pair, and listed by row.
class Findings {
 public:
  /// Disagreements are appended to a list: their table comes last.
  Findings(Report& report, std::string pair, std::vector<Report::Json>& disagreements)
      : report_(report), pair_(std::move(pair)), disagreements_(disagreements) {}

  void add(const ContactCase& c, const ContactVerdict& verdict) {
    ++cases_;
    meet_ += c.meet();
    wrong_ += verdict.wrong.size();
    for (const std::string& wrong : verdict.wrong) list(c, verdict, "WRONG: " + wrong);
    if (c.held) {
      ++held_;
      held_found_ += verdict.matched;
      held_by_fcl_ += verdict.fcl;
      held_by_bullet_ += verdict.bullet;
      held_low_ = std::min(held_low_, verdict.held_share);
      held_high_ = std::max(held_high_, verdict.held_share);
    }
    if (!c.meet())
      widths_.push_back(verdict.interval_width / c.a->closed->report.bounds.diagonal().norm());
    if (verdict.protrusion) {
      ++protrusion_;
      char reason[160];
      std::snprintf(reason, sizeof reason,
                    "protrusion: the gap, %.3g u, is below the protrusions' sum, %.3g u",
                    c.surface_distance, c.a->protrusion + c.b->protrusion);
      list(c, verdict, reason);
    }
    shallow_ += verdict.shallow;
    if (c.cross() && !verdict.matched) {
      ++unfound_;
      list(c, verdict, "shallow band: moved out by cover radii and protrusions, nothing crosses");
    }
    if (verdict.bullet && !c.cross()) {
      ++bullet_false_;
      list(c, verdict, "Bullet passes triangles that cross each other's planes without touching");
    }
    if (!verdict.bullet && c.cross()) {
      ++bullet_missed_;
      list(c, verdict, "Bullet misses a contact that FCL and the exact distance show");
    }
    if (verdict.fcl != c.cross()) list(c, verdict, "FCL disagrees with the exact distance");
  }

  void write() const {
    report_.row("Contact or none", {{"pair", pair_},
                                    {"cases", cases_},
                                    {"meet", meet_},
                                    {"wrong answers of ist", wrong_},
                                    {"gaps within the protrusions", protrusion_},
                                    {"crossings in the shallow band", shallow_},
                                    {"of them read 0", unfound_},
                                    {"Bullet: contact at a gap", bullet_false_},
                                    {"Bullet: missed", bullet_missed_}});
    if (held_ > 0)
      report_.row("One solid holds the other", {{"pair", pair_},
                                                {"cases", held_},
                                                {"found by ist", held_found_},
                                                {"by FCL", held_by_fcl_},
                                                {"by Bullet", held_by_bullet_},
                                                {"overlap / held volume, least", held_low_},
                                                {"most", held_high_}});
    if (!widths_.empty())
      report_.row("Certified intervals of the distance",
                  {{"pair", pair_},
                   {"cases apart", widths_.size()},
                   {"width median / A's diagonal", quantile(widths_, 0.5)},
                   {"p95", quantile(widths_, 0.95)}});
    report_.target("wrong answers, " + pair_, static_cast<double>(wrong_), 0, true);
  }

 private:
  static const char* yes_no(bool value) { return value ? "yes" : "no"; }

  void list(const ContactCase& c, const ContactVerdict& verdict, const std::string& reason) {
    disagreements_.push_back({{"pair", pair_},
                              {"case", c.name},
                              {"exact", c.held      ? "held"
                                        : c.cross() ? "cross"
                                                    : "apart"},
                              {"ist", yes_no(verdict.matched)},
                              {"FCL", yes_no(verdict.fcl)},
                              {"Bullet", yes_no(verdict.bullet)},
                              {"reason", reason}});
  }

  Report& report_;
  std::string pair_;
  std::vector<Report::Json>& disagreements_;
  std::size_t cases_ = 0, meet_ = 0, wrong_ = 0, protrusion_ = 0, shallow_ = 0, unfound_ = 0;
  std::size_t bullet_false_ = 0, bullet_missed_ = 0;
  std::size_t held_ = 0, held_found_ = 0, held_by_fcl_ = 0, held_by_bullet_ = 0;
  double held_low_ = 1, held_high_ = 0;
  std::vector<double> widths_;
};

/// Angles of the three libraries' pushes on B to the exact one.
class Angles {
 public:
  void add(const ContactCase& c, const ist::testing::ForceAngles& angles) {
    ist_.push_back(angles.ist);
    fcl_.push_back(angles.fcl);
    bullet_.push_back(angles.bullet);
    const double area = angles.found.force.norm();
    const double depth = area > 0 ? angles.found.volume / area : 0;
    cases_.emplace_back(angles.ist,
                        Report::Json{{"case", c.name},
                                     {"ist °", angles.ist},
                                     {"FCL °", angles.fcl},
                                     {"Bullet °", angles.bullet},
                                     {"overlap / smaller solid",
                                      angles.found.volume / std::min(c.a->volume(), c.b->volume())},
                                     {"depth / leaf radius",
                                      depth / std::max(c.a->leaf_radius(), c.b->leaf_radius())}});
  }
  /// How far the surface integral, where it stands in for the exact gradient, is from it.
  void add_integral(double angle) { integral_.push_back(angle); }

  void write(Report& report, const std::string& pair) const {
    if (ist_.empty()) return;
    Report::Json row = {{"pair", pair}, {"rows", ist_.size()}};
    const auto put = [&](const std::string& of, const std::vector<double>& angles) {
      row[of + " median °"] = quantile(angles, 0.5);
      row[of + " p95 °"] = quantile(angles, 0.95);
    };
    put("ist", ist_);
    put("FCL", fcl_);
    put("Bullet", bullet_);
    if (!integral_.empty()) put("surface integral", integral_);
    report.row("Direction of the force", row);
  }

  /// The rows of one pair where ist is furthest off are appended to a list.
  void list_worst(const std::string& pair, std::vector<Report::Json>& worst) const {
    std::vector<std::pair<double, Report::Json>> cases = cases_;
    const std::size_t count = std::min<std::size_t>(3, cases.size());
    std::partial_sort(cases.begin(), cases.begin() + static_cast<std::ptrdiff_t>(count),
                      cases.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    for (std::size_t i = 0; i < count; ++i) {
      Report::Json row = {{"pair", pair}};
      row.update(cases[i].second);
      worst.push_back(row);
    }
  }

 private:
  std::vector<double> ist_, fcl_, bullet_, integral_;
  std::vector<std::pair<double, Report::Json>> cases_;
};

/// Tables that come last, filled pair by pair.
struct Lists {
  std::vector<Report::Json> disagreements, worst_angles;
};

void ask_oracle_rows(Report& report, ist::testing::ContactJudge& judge, const std::string& key,
                     std::size_t spheres, Lists& lists) {
  const auto rows = ist::testing::read_oracle_rows(key);
  ist::testing::Model a(ist::testing::oracle_mesh_path(rows.front().mesh_a), spheres);
  ist::testing::Model b(ist::testing::oracle_mesh_path(rows.front().mesh_b), spheres);
  Findings findings(report, key, lists.disagreements);
  Angles angles;
  for (const ist::testing::OracleRow& row : rows) {
    const ContactCase c = case_of(row, a, b);
    findings.add(c, judge.judge(c));
    if (row.pose_class != "pen" || row.fraction_of_smaller < 1e-3) continue;
    angles.add(c, judge.angles(c));
    angles.add_integral(ist::testing::degrees_between(
        -gradient_by_surface(c, ist::testing::kSurfacePoints), c.exit));
  }
  findings.write();
  angles.write(report, key);
  angles.list_worst(key, lists.worst_angles);
}

void ask_random_poses(Report& report, ist::testing::ContactJudge& judge, const MeshPair& pair,
                      std::size_t spheres, int poses, Lists& lists) {
  const auto path = [](const char* name) {
    return ist::testing::shared_path(std::string("meshes/dev/") + name).string();
  };
  ist::testing::Model a(path(pair.a), spheres), b(path(pair.b), spheres);
  ist::testing::RandomContacts contacts(a, b, pair.size_b, 5);
  Findings findings(report, pair.name, lists.disagreements);
  Angles angles;
  for (int i = 0; i < poses; ++i) {
    const ContactCase c = contacts.next();
    const ContactVerdict verdict = judge.judge(c);
    findings.add(c, verdict);
    if (c.cross() && !verdict.shallow) angles.add(c, judge.angles(c));
  }
  findings.write();
  angles.write(report, pair.name);
  angles.list_worst(pair.name, lists.worst_angles);
}

}  // namespace

int main(int argc, char** argv) {
  Report report("checked_against", argc, argv);
  report.page("Checked against FCL, Bullet and exact answers");
  const std::size_t spheres = report.quick() ? 1'000 : 4'000;
  const int poses = report.quick() ? 30 : 200;
  report.remark(
      "Assets of " + std::to_string(spheres) +
      " spheres. Pairs `eledino` … `ico20k`: all rows of the oracle, whose volumes, "
      "distances and forces are exact. Other pairs: " +
      std::to_string(poses) +
      " random poses, a third with B at a tenth of its size; FCL's distance and a winding "
      "number by solid angles decide what is true.");
  report.remark(
      "A wrong answer of ist: inner spheres overlap though the solids are apart; a true distance "
      "outside the certified interval; a held solid not found; a matched overlap at a gap wider "
      "than both largest protrusions; crossing surfaces that read 0 deeper than the shallow band. "
      "The band: moving B out by both largest protrusions and both largest cover layers (cover "
      "radius less radius) ends the contact.");
  report.remark(
      "Bullet is its double-precision build with margin 0. FCL and Bullet see surfaces: a solid "
      "wholly inside another is no contact to them.");
  report.remark(
      "Direction of the force: angle between the push on B (FCL, Bullet: the depth-weighted mean "
      "of "
      "their contact normals) and the exact gradient. For random poses that is B's normal, "
      "integrated over B's surface inside A; how far this integral is from the oracle's gradients "
      "stands in the first four rows. Random crossings in the shallow band are left out.");
  report.remark(
      "Forces furthest off: depth is volume / |force|, a leaf's radius (3 V / 4 π N)^⅓ of the "
      "coarser "
      "solid. Directions are off where the overlap is no deeper than a leaf, so that a handful of "
      "spheres decides (the oracle's rows); where pushes from opposite sides all but cancel, and "
      "depth comes out large; and where parts are as thin as a leaf (perforated tray, Menger "
      "sponge). "
      "The direction is that of the sum's own gradient (`property_query`): more spheres turn it "
      "right, as volume_error shows from 300 to 30,000.");
  ist::testing::ContactJudge judge;
  Lists lists;
  for (const std::string& key : ist::testing::kPairKeys)
    ask_oracle_rows(report, judge, key, spheres, lists);
  for (const MeshPair& pair : kMeshPairs)
    ask_random_poses(report, judge, pair, spheres, poses, lists);
  for (const Report::Json& row : lists.worst_angles) report.row("Forces furthest off", row);
  for (const Report::Json& row : lists.disagreements) report.row("Disagreements", row);
  return report.write();
}
