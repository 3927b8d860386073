#include <fmt/format.h>
#include <ist/bake.h>
#include <ist/mass_properties.h>
#include <ist/shapes.h>
#include <spdlog/spdlog.h>
#include <algorithm>
#include <chrono>
#include <memory>

#include "app/commands.h"
#include "app/options.h"
#include "app/query_rows.h"
#include "library/asset_summary.h"
#include "library/settings/numbers.h"

namespace ist::app {
namespace {

using Eigen::Vector3d;

/// The numbers of a kind of shape, in the user's notation.
struct FieldKind {
  const char* name;
  std::vector<const char*> numbers;
  const char* meaning;
};

const std::array<FieldKind, 5>& kinds() {
  static const std::array<FieldKind, 5> all = {
      FieldKind{"plane",
                {"nx", "ny", "nz", "d"},
                "the solid n · x ≤ d: an outward normal n of any length above 0 and d"},
      FieldKind{"box", {"hx", "hy", "hz"}, "half extents above 0"},
      FieldKind{"ball", {"r"}, "a radius above 0"},
      FieldKind{"capsule",
                {"r", "h"},
                "a radius above 0 and the half height, 0 or more, of the segment along z"},
      FieldKind{"cylinder", {"r", "h"}, "a radius and a half height along z, above 0"}};
  return all;
}

const FieldKind* kind_of(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return nullptr;
  const std::string_view name = text.substr(0, colon);
  for (const FieldKind& kind : kinds())
    if (name == kind.name) return &kind;
  return nullptr;
}

/// A description, and the error messages about it.
class Spec {
 public:
  Spec(const std::string& text, const FieldKind& kind) : text_(text), kind_(kind) {
    std::string_view rest = std::string_view(text).substr(text.find(':') + 1);
    std::vector<std::string_view> fields;
    for (std::size_t comma; (comma = rest.find(',')) != std::string_view::npos;) {
      fields.push_back(rest.substr(0, comma));
      rest.remove_prefix(comma + 1);
    }
    fields.push_back(rest);
    if (fields.size() != kind.numbers.size())
      fail(fmt::format("it has {} number{}, not {}", fields.size(), fields.size() == 1 ? "" : "s",
                       kind.numbers.size()));
    for (std::size_t k = 0; k < fields.size(); ++k) {
      const std::optional<double> value = parse_number(fields[k]);
      if (!value || !std::isfinite(*value))
        fail(fmt::format("{} = '{}' is not a finite number", kind.numbers[k], fields[k]));
      values_.push_back(*value);
    }
  }

  double number(std::size_t k) const { return values_[k]; }

  /// [u] positive, or nonnegative.
  double length(std::size_t k, bool may_be_zero = false) const {
    const double value = values_[k];
    if (!(may_be_zero ? value >= 0 : value > 0))
      fail(fmt::format("{} = {:g} is not {}", kind_.numbers[k], value,
                       may_be_zero ? "0 or more" : "above 0"));
    if (value > kLongest)
      fail(fmt::format("{} = {:g} is more than {:g}", kind_.numbers[k], value, kLongest));
    return value;
  }

  HalfSpaceShape plane() const {
    const Vector3d normal(values_[0], values_[1], values_[2]);
    const double length = normal.stableNorm();
    if (!(length > 0)) fail("the normal is zero and has no direction");
    const double offset = values_[3] / length;
    if (!(std::abs(offset) <= kLongest))
      fail(fmt::format("the plane is {:g} away, more than {:g}", offset, kLongest));
    return {normal.stableNormalized(), offset};
  }

 private:
  static constexpr double kLongest = 1e150;  // [u] limit of the queries

  [[noreturn]] void fail(const std::string& fault) const {
    throw Error(fmt::format("'{}' is not a {}: {}; write {}:{}, {}", text_, kind_.name, fault,
                            kind_.name, fmt::join(kind_.numbers, ","), kind_.meaning));
  }

  const std::string& text_;
  const FieldKind& kind_;
  std::vector<double> values_;
};

/// True if an argument describes a shape and not a file: it begins with a kind and a colon.
bool is_field_spec(const std::string& text) { return kind_of(text) != nullptr; }

/// Throws Error that states the fault of the description and what is expected.
Shape parse_field(const std::string& text) {
  const FieldKind* const kind = kind_of(text);
  if (kind == nullptr) throw Error("'" + text + "' does not describe a shape");
  const Spec spec(text, *kind);
  const std::string_view name = kind->name;
  if (name == "plane") return spec.plane();
  if (name == "box") return BoxShape{Vector3d(spec.length(0), spec.length(1), spec.length(2))};
  if (name == "ball") return BallShape{spec.length(0)};
  if (name == "capsule") return CapsuleShape{spec.length(0), spec.length(1, true)};
  return CylinderShape{spec.length(0), spec.length(1)};
}

struct QueryOptions {
  std::string a, asset_b, pose, poses;
  std::vector<std::string> classes;
  double scale_b = 1;
  bool scale_b_given = false;
  QuerySettings settings;
  std::uint32_t max_visits = 0;
  std::size_t repeat = 1;
  bool json = false, csv = false;
};

/// A validator for CLI11: "" or the fault.
std::string is_pose(const std::string& text) {
  try {
    parse_pose(text);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

/// "", or the fault of a description of a shape; "" for file names.
std::string field_fault(const std::string& text) {
  try {
    if (is_field_spec(text)) parse_field(text);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

/// "", or advice if B is described as a shape.
std::string not_an_asset(const std::string& text) {
  if (!is_field_spec(text)) return "";
  return fmt::format(
      "'{0}' is a shape, and only A can be a shape. Pass it first and the .ist file second, with "
      "the pose of that asset in the shape's frame. For a file of this name write ./{0}",
      text);
}

/// Throws Error if no row has one of the classes, which is probably misspelled.
void keep_classes(PoseTable& table, const QueryOptions& options) {
  if (!table.has_labels) throw Error(options.poses + ": no column 'class', which --class needs");
  const auto is_of = [](const std::string& name) {
    return [&name](const PoseRow& row) { return row.label == name; };
  };
  for (const std::string& name : options.classes)
    if (std::none_of(table.rows.begin(), table.rows.end(), is_of(name)))
      throw Error(fmt::format("{}: none of the {} rows has the class '{}'", options.poses,
                              table.rows.size(), name));
  std::erase_if(table.rows, [&](const PoseRow& row) {
    return std::find(options.classes.begin(), options.classes.end(), row.label) ==
           options.classes.end();
  });
}

std::vector<PoseRow> asked_rows(const QueryOptions& options) {
  if (!options.pose.empty()) return {{"0", "", parse_pose(options.pose), options.scale_b}};
  PoseTable table = read_pose_table(options.poses);
  if (table.has_scales && options.scale_b_given)
    throw CLI::ValidationError("--scale-b", "conflicts with the column scale_b of " +
                                                options.poses + "; remove one of them");
  if (!table.has_scales)
    for (PoseRow& row : table.rows) row.scale_b = options.scale_b;
  if (!options.classes.empty()) keep_classes(table, options);
  return table.rows;
}

/// Answers every row, in `repeat` rounds over all rows in turn, so that no row trains the branch
/// predictor for itself. A row's time is the minimum over the rounds.
std::vector<Answer> answer(const PlacedSolid& a, const AssetView& b,
                           const std::vector<PoseRow>& rows, const QueryOptions& options) {
  using Clock = std::chrono::steady_clock;
  std::vector<Answer> answers;
  answers.reserve(rows.size());
  for (const PoseRow& row : rows)
    answers.push_back({row, {}, std::numeric_limits<double>::infinity()});
  Workspace workspace;
  for (std::size_t round = 0; round < options.repeat; ++round)
    for (Answer& answer : answers) {
      const PlacedAsset placed_b{b, answer.row.pose, answer.row.scale_b};
      const Clock::time_point start = Clock::now();
      const PenetrationAndSeparation result = query(a, placed_b, options.settings, workspace);
      const Clock::time_point end = Clock::now();
      answer.result = result;
      answer.time_us =
          std::min(answer.time_us, std::chrono::duration<double, std::micro>(end - start).count());
    }
  return answers;
}

/// Throws CLI::ValidationError if settings exclude each other.
void check_settings(const QueryOptions& options) {
  const PenetrationSettings& settings = options.settings.penetration;
  const bool exact = settings.measure == Measure::exact;
  const auto no_effect = [&](const char* option) {
    throw CLI::ValidationError(option, fmt::format("has no effect with --measure {}, only with "
                                                   "matched",
                                                   exact ? "exact" : "inner"));
  };
  if (settings.measure != Measure::matched) {
    if (settings.pair_budget != 0) no_effect("--pair-budget");
    if (settings.relative_error != 0) no_effect("--error");
    if (settings.spheres_only) no_effect("--spheres-only");
  }
  if (!is_field_spec(options.a)) return;
  if (exact)
    throw CLI::ValidationError(
        "--measure", "exact needs the meshes of two assets, and A is a shape: " + options.a +
                         "; omit the option, or pass an .ist file of the same shape");
  for (const auto& [option, given] : {std::pair("--spheres-only", settings.spheres_only),
                                      std::pair("--pair-budget", settings.pair_budget != 0),
                                      std::pair("--error", settings.relative_error != 0)})
    if (given) throw CLI::ValidationError(option, "has no effect where A is a shape: " + options.a);
}

/// Throws Error if an asset lacks the data that the measure needs.
void require_held(const std::string& path, const AssetView& tree, Measure measure) {
  if (measure != Measure::exact) {
    if (tree.sphere_count() > 0) return;
    throw Error(
        fmt::format("{}: has no spheres, which --measure {} needs; use --measure exact, or bake it "
                    "again without --mesh-only",
                    path, measure == Measure::inner ? "inner" : "matched"));
  }
  if (tree.has_mesh()) return;
  const std::string twice = describe_counted_twice(tree);
  if (!twice.empty())
    throw Error(fmt::format(
        "{}: {}; use --measure matched, or bake a mesh whose parts do not overlap", path, twice));
  throw Error(path +
              ": has no mesh, which --measure exact needs; bake it again with --keep-mesh yes, or "
              "use --measure matched");
}

/// Warns once on stderr if spheres alone are requested where they are inaccurate.
void warn_of_misfit(const AssetView& a, const AssetView& b, const std::vector<PoseRow>& rows,
                    const QueryOptions& options) {
  const PenetrationSettings& settings = options.settings.penetration;
  if (settings.measure != Measure::matched || settings.spheres_only) return;
  for (const PoseRow& row : rows) {
    const SizeMatch fit = size_match({a, {}, 1}, {b, {}, row.scale_b});
    if (fit.fits()) continue;
    spdlog::warn(
        "{}: its spheres are {:.2g} times as coarse as those of {}, and {} has no mesh: volumes "
        "and "
        "forces may be far off. Bake it again with --keep-mesh yes",
        fit.a_is_coarser ? options.a : options.asset_b, fit.ratio,
        fit.a_is_coarser ? options.asset_b : options.a, a.has_mesh() ? options.asset_b : options.a);
    return;
  }
}

std::vector<Answer> answer(const std::vector<PoseRow>& rows, const QueryOptions& options) {
  const Measure measure = options.settings.penetration.measure;
  if (is_field_spec(options.a)) {
    const Asset b = Asset::load(options.asset_b);
    require_held(options.asset_b, b.view(), measure);
    return answer(PlacedShape{parse_field(options.a), {}, 1}, b.view(), rows, options);
  }
  const Asset a = Asset::load(options.a);
  const Asset b = Asset::load(options.asset_b);
  // Mesh-only queries are exact.
  const bool surfaces =
      options.settings.penetration.relative_error > 0 && a.view().has_mesh() && b.view().has_mesh();
  if (!surfaces) {
    require_held(options.a, a.view(), measure);
    require_held(options.asset_b, b.view(), measure);
  }
  warn_of_misfit(a.view(), b.view(), rows, options);
  std::vector<Answer> answers = answer(PlacedAsset{a.view(), {}, 1}, b.view(), rows, options);
  for (Answer& one : answers) {
    one.surfaces = a.view().has_mesh() && b.view().has_mesh();
    one.exact = measure == Measure::exact && one.result.penetration.status == QueryStatus::ok;
  }
  return answers;
}

void run_query(const QueryOptions& options) {
  check_settings(options);
  const std::vector<Answer> answers = answer(asked_rows(options), options);
  if (options.json) {
    fmt::print("{}", answers_json(answers));
  } else if (options.csv || options.pose.empty()) {
    fmt::print("{}", answers_csv(answers));
  } else {
    fmt::print("A = {}, B = {}\n{}", options.a, options.asset_b,
               answer_text(answers.front(), options.settings.penetration));
  }
}

}  // namespace

void add_query(CLI::App& app) {
  const auto options = std::make_shared<QueryOptions>();
  CLI::App* const command =
      app.add_subcommand("query", "Overlap and distance of two solids, B placed in A's frame");
  add_input(command, "A", options->a,
            "An .ist file, or a shape: plane:nx,ny,nz,d (the solid n·x ≤ d), box:hx,hy,hz (half "
            "extents), ball:r, capsule:r,h or cylinder:r,h (h = half the height along z). Lengths "
            "are in [u]")
      ->check(field_fault);
  add_input(command, "B", options->asset_b, "An .ist file")->check(not_an_asset);
  CLI::Option_group* const poses = command->add_option_group("Poses", "Pose of B");
  poses
      ->add_option("--pose", options->pose,
                   "qw,qx,qy,qz,tx,ty,tz: x_A = R (scale · x_B) + t; the quaternion is normalised")
      ->check(is_pose);
  CLI::Option* const file = poses->add_option(
      "--poses", options->poses,
      "CSV file with these columns and optionally id, class and scale_b; - = standard input");
  file->check([](const std::string& text) { return text.empty() ? "'' is not a file name" : ""; });
  poses->require_option(1);
  CLI::Option* const scale =
      add_number(command, "--scale-b", options->scale_b, {.least = 0, .without_least = true},
                 "Uniform scale of B about its origin");
  command->add_option("--class", options->classes, "Only rows of this class. Repeatable")
      ->take_all()
      ->allow_extra_args(false)
      ->needs(file);
  command
      ->add_option_function<std::string>(
          "--measure",
          [options](const std::string& name) {
            options->settings.penetration.measure = name == "exact"   ? Measure::exact
                                                    : name == "inner" ? Measure::inner
                                                                      : Measure::matched;
          },
          "matched: spheres with the solid's volume, accurate; inner: spheres inside the solid, a "
          "lower bound; exact: the kept meshes of both assets, the true volume with bounds")
      ->check(CLI::IsMember({"matched", "inner", "exact"}))
      ->default_str("matched");
  command->add_flag(
      "--spheres-only", options->settings.penetration.spheres_only,
      "Sum spheres even where they are too coarse for solids of unlike sizes, and may "
      "be wrong by any factor; otherwise the kept meshes answer there. Matched measure "
      "only");
  add_whole(command, "--pair-budget", options->settings.penetration.pair_budget,
            "Use the level of detail that needs about this many sphere pairs; 0 = the finest. "
            "Matched measure only");
  add_number(
      command, "--error", options->settings.penetration.relative_error,
      {.least = 0, .most = 1, .without_most = true},
      "Accepted relative error of the volume, e.g. 0.5%; 0 = all spheres. The query uses the "
      "coarsest level of detail whose predicted error is smaller, or the kept meshes if those are "
      "cheaper. Matched measure only",
      true);
  add_whole(command, "--max-visits", options->max_visits,
            "Limit of node pairs, for penetration and for separation; 0 = no limit");
  add_number(
      command, "--max-distance", options->settings.separation.max_distance, {.least = 0},
      "Largest distance that matters, in u; 0 = no limit. If the solids are certainly farther "
      "apart, distance and distance_min are this number and distance_max is inf");
  add_whole<std::size_t>(command, "--repeat", options->repeat,
                         "Number of rounds over all rows; time_us is the minimum of a row", 1);
  CLI::Option* const json = command->add_flag("--json", options->json, "Print JSON");
  command->add_flag("--csv", options->csv, "Print CSV (the default with --poses)")->excludes(json);
  command->footer(
      "Gradients are with respect to a motion of B, in A's frame. A pressure k [force/u²]\n"
      "exerts k times the force and, about B's origin, the torque on B.\n"
      "A shape defines A's frame. For a file named box:1,1,1 write ./box:1,1,1.\n"
      "Example: ist query bolt.ist nut.ist --pose 1,0,0,0,0,0,9\n"
      "         ist query bolt.ist nut.ist --pose 1,0,0,0,0,0,9 --measure exact\n"
      "         ist query bolt.ist nut.ist --pose 1,0,0,0,0,0,9 --error 0.5%\n"
      "         ist query plane:0,0,1,0 bolt.ist --pose 1,0,0,0,0,0,-0.5");
  command->callback([options, scale] {
    options->scale_b_given = scale->count() > 0;
    QuerySettings& settings = options->settings;
    settings.penetration.max_visits = settings.separation.max_visits = options->max_visits;
    run_query(*options);
  });
}

}  // namespace ist::app
