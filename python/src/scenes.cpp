#include <ist/query_tbb.h>
#include <ist/scene.h>
#include <ist/types.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/unique_ptr.h>

#include "penetration.h"
#include "query/find_solid_box.h"
#include "surfaces.h"

namespace ist::python {
namespace {

constexpr std::pair<const char*, SceneAnswer> kAnswers[] = {
    {"nothing", SceneAnswer::nothing},
    {"boxes", SceneAnswer::boxes},
    {"overlap", SceneAnswer::overlap},
    {"penetration", SceneAnswer::penetration},
    {"impact", SceneAnswer::impact}};

struct PyScene {
  explicit PyScene(Scene made) : scene(std::move(made)) {}

  Scene scene;
  std::uint32_t next = 0;
  std::map<std::uint32_t, py::object> owners;
};

struct SceneAnswers {
  Shape rows;
  Column<std::uint32_t, 2> pairs{rows}, ended{};
  Column<bool> begins{rows};
  Column<std::uint32_t> overlapping{rows}, refused{};
  std::shared_ptr<Penetrations> penetration{};
  std::shared_ptr<Separations> separation{};
  std::shared_ptr<Impacts> impact{};
};

/// The hits of rays and points, with their bodies.
struct SceneHits {
  Shape rows;
  Column<std::uint32_t> number{rows};
  std::shared_ptr<RayHits> hit{};
};
struct ScenePoints {
  Shape rows;
  Column<std::uint32_t> number{rows};
  std::shared_ptr<SurfacePoints> surface{};
};

Pose pose_at(const double* row) {
  Pose pose;
  std::copy_n(row, 4, pose.q);
  std::copy_n(row + 4, 3, pose.t);
  return pose;
}

/// The bodies for the `count` rows of `name`: `numbers`, or all moving ones, by number.
std::vector<std::uint32_t> bodies_of(const PyScene& self, const std::size_t count,
                                     const std::string& name, const py::object& numbers) {
  std::vector<std::uint32_t> of;
  if (numbers.is_none()) {
    for (const auto& [number, owner] : self.owners)
      if (self.scene.body(number)->moves) of.push_back(number);
    if (of.size() != count)
      throw value_error(name + ": " + std::to_string(count) + " rows; wanted " +
                        std::to_string(of.size()) +
                        ", one for each body that moves, by number, or give numbers=");
  } else {
    const Integers given = take_integers(numbers, "numbers", "(n,)");
    if (given.size() != count)
      throw value_error("numbers: " + std::to_string(given.size()) + " for " +
                        std::to_string(count) + " rows of " + name);
    for (std::size_t i = 0; i < count; ++i) {
      const std::int64_t number = given.data()[i];
      if (number < 0 || self.owners.count(static_cast<std::uint32_t>(number)) == 0)
        throw value_error("numbers: there is no body " + std::to_string(number));
      of.push_back(static_cast<std::uint32_t>(number));
    }
  }
  return of;
}

void set_poses(PyScene& self, const py::object& poses, const py::object& numbers) {
  const Doubles rows = take_poses(poses, "poses", "(n, 7) or (n, 4, 4)");
  std::vector<Pose> to(rows.size() / 7);
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = pose_at(rows.data() + 7 * i);
  self.scene.set_poses(bodies_of(self, to.size(), "poses", numbers), to);
}

void set_motions(PyScene& self, const py::object& velocities, const py::object& numbers,
                 const py::object& about) {
  const Doubles rows = take_doubles(velocities, "velocities", "(n, 6)");
  if (rows.ndim() != 2 || rows.shape(1) != 6) refuse_shape(rows, "velocities", "(n, 6)");
  const Places points(about, "about");
  std::vector<Motion> to(rows.shape(0));
  if (!points.rows.empty() && points.count != to.size())
    throw value_error("about: " + std::to_string(points.count) + " rows; velocities have " +
                      std::to_string(to.size()));
  for (std::size_t i = 0; i < to.size(); ++i)
    to[i] = {Eigen::Vector3d(rows.data() + 6 * i), Eigen::Vector3d(rows.data() + 6 * i + 3),
             points.at(i)};
  self.scene.set_motions(bodies_of(self, to.size(), "velocities", numbers), to);
}

std::unique_ptr<SceneHits> cast_rays(const PyScene& self, const py::object& origins,
                                     const py::object& directions, const double max_distance) {
  const Places from(origins, "origins"), along(directions, "directions");
  auto out = std::make_unique<SceneHits>(SceneHits{rows_of(from, along)});
  out->hit = std::make_shared<RayHits>(RayHits{out->rows});
  const py::gil_scoped_release free;
  for (std::size_t i = 0; i < std::max(from.count, along.count); ++i) {
    const SceneHit found = self.scene.raycast(Ray{from.at(i), along.at(i), max_distance});
    out->number.write(i, found.number);
    write_row(*out->hit, i, found.hit);
  }
  return out;
}

std::unique_ptr<ScenePoints> nearest(const PyScene& self, const py::object& points,
                                     const double max_distance) {
  const Places places(points, "points");
  auto out = std::make_unique<ScenePoints>(ScenePoints{places.rows});
  out->surface = std::make_shared<SurfacePoints>(SurfacePoints{out->rows});
  const py::gil_scoped_release free;
  for (std::size_t i = 0; i < places.count; ++i) {
    const SceneNearest found = self.scene.nearest(places.at(i), max_distance);
    out->number.write(i, found.number);
    write_row(*out->surface, i, found.surface);
  }
  return out;
}

/// Numbers of the bodies whose boxes meet this one.
Column<std::uint32_t> in_box(const PyScene& self, const Eigen::Vector3d& lower,
                             const Eigen::Vector3d& upper) {
  std::vector<std::uint32_t> numbers(self.scene.size());
  numbers.resize(self.scene.in_box(lower, upper, numbers));
  std::sort(numbers.begin(), numbers.end());
  Column<std::uint32_t> out({numbers.size()});
  for (std::size_t i = 0; i < numbers.size(); ++i) out.write(i, numbers[i]);
  return out;
}

/// For ist.trimesh: (2, n), bodies whose boxes are within `margin` of those of placed solids, and
/// the indices of these.
py::object near(const PyScene& self, const SolidRows& solids, const py::object& poses,
                double margin) {
  const Integers rows = take_integers(solids.index, "solids", "(n,) indices");
  const Doubles at = take_doubles(poses, "poses", "(n, 7)");
  if (at.size() != 7 * rows.size()) refuse_shape(at, "poses", "(n, 7)");
  std::vector<std::uint32_t> numbers(self.scene.size());
  std::vector<std::pair<std::uint32_t, std::int64_t>> found;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::int64_t row = rows.data()[i];
    const SolidBox own =
        solid_box(std::get<AssetView>(solids.among().views.at(static_cast<std::size_t>(row))));
    Pose pose;
    std::copy_n(at.data() + 7 * i, 4, pose.q);
    std::copy_n(at.data() + 7 * i + 4, 3, pose.t);
    const Rotation turn = Rotation::of(pose.q);
    if (!own.placed(turn, pose.t, 0).fits()) throw value_error("an object reaches beyond 1e37 u");
    const WorldBox box = own.placed(turn, pose.t, margin);
    const std::size_t count = self.scene.in_box(vector(box.low), vector(box.high), numbers);
    std::sort(numbers.data(), numbers.data() + count);
    for (std::size_t k = 0; k < count; ++k) found.emplace_back(numbers[k], row);
  }
  const Column<std::int64_t> out({2, found.size()});
  for (std::size_t i = 0; i < found.size(); ++i) {
    out.write(i, found[i].first);
    out.write(found.size() + i, found[i].second);
  }
  return out.handed_out();
}

SceneStep ask_step(PyScene& self, const py::object& poses, const py::object& numbers) {
  if (!poses.is_none())
    set_poses(self, poses, numbers);
  else if (!numbers.is_none())
    throw value_error("numbers: without poses");
  SceneStep found;
  {
    const py::gil_scoped_release free;
    found = self.scene.step(tbb_parallel_for());
  }
  if (found.pairs_exceeded)
    throw Error("more than " + std::to_string(self.scene.settings().max_pairs) +
                " pairs of bodies have boxes that meet: make the Scene with a larger max_pairs");
  return found;
}

std::shared_ptr<SceneAnswers> step(PyScene& self, const py::object& poses,
                                   const py::object& numbers) {
  const SceneStep found = ask_step(self, poses, numbers);
  auto out = std::make_shared<SceneAnswers>(SceneAnswers{{found.pairs.size()}});
  out->penetration = std::make_shared<Penetrations>(Penetrations{out->rows});
  out->separation = std::make_shared<Separations>(Separations{out->rows});
  out->impact = std::make_shared<Impacts>(Impacts{out->rows});
  for (std::size_t i = 0; i < found.pairs.size(); ++i) {
    const ScenePair& pair = found.pairs[i];
    out->pairs.row(i)[0] = pair.a;
    out->pairs.row(i)[1] = pair.b;
    out->begins.write(i, pair.event == SceneEvent::begins);
    out->overlapping.write(i, pair.overlapping);
    if (pair.slot == ScenePair{}.slot) continue;  // they stay zero
    Row row;
    const auto pose_of = [&](std::uint32_t number) {
      const SceneBody body = *self.scene.body(number);
      return std::visit([](const auto& placed) { return placed.pose; }, body.solid.placed);
    };
    row.a.pose = pose_of(pair.a);
    row.b.pose = pose_of(pair.b);
    out->penetration->write(i, row, self.scene.penetration(pair));
    write_row(*out->separation, i, self.scene.separation(pair));
    write_row(*out->impact, i, self.scene.impact(pair));
  }
  out->ended = Column<std::uint32_t, 2>({found.ended.size()});
  for (std::size_t i = 0; i < found.ended.size(); ++i) {
    out->ended.row(i)[0] = found.ended[i].a;
    out->ended.row(i)[1] = found.ended[i].b;
  }
  out->refused = Column<std::uint32_t>({found.refused.size()});
  for (std::size_t i = 0; i < found.refused.size(); ++i) out->refused.write(i, found.refused[i]);
  return out;
}

std::uint32_t add(PyScene& self, const py::object& solid, const py::object& pose, double scale,
                  const py::object& number, bool moves, std::uint32_t group, std::uint32_t layers,
                  std::uint32_t meets) {
  SceneBody body;
  body.number = self.next;
  if (!number.is_none() && !py::try_cast(number, body.number))
    throw value_error("number: " + text_of(number) + "; wanted a whole number from 0 to 2³² − 1");
  const Pose at = take_pose(pose, scale);
  body.solid = std::visit([&](const auto& what) { return PlacedSolid(what, at, scale); },
                          solid_of(solid, "solid"));
  body.moves = moves;
  body.group = group;
  body.layers = layers;
  body.meets = meets;
  self.scene.add(body);
  self.owners[body.number] = solid;
  self.next = self.owners.rbegin()->first + 1;
  return body.number;
}

std::size_t workers_of(unsigned threads) {
  const unsigned workers = take_threads(threads);
  return workers != 0 ? workers : std::max(1u, std::thread::hardware_concurrency());
}

std::unique_ptr<PyScene> replay(const py::bytes& record, const py::object& assets,
                                unsigned threads) {
  const py::list given(assets);
  std::vector<AssetView> trees;
  for (const py::handle asset : given) trees.push_back(tree_of(asset, "assets"));
  auto out = std::make_unique<PyScene>(
      Scene::replay({reinterpret_cast<const std::byte*>(record.c_str()), record.size()}, trees,
                    workers_of(threads)));
  // A body may refer to the memory of any of the assets.
  for (const std::uint32_t number : out->scene.numbers()) out->owners[number] = given;
  if (!out->owners.empty()) out->next = out->owners.rbegin()->first + 1;
  return out;
}

constexpr const char* kSceneDoc =
    R"(Many solids, and which of them meet: ist.Scene in <ist/scene.h>.

Bodies have numbers. A step asks the pairs whose boxes meet and of which a body was added or moved; of
the others the answers are those of the step before. Poses and rules alone decide the answers and their
order.

max_bodies, max_pairs: memory for as many is taken at once. threads: that work at a step; 0: all
cores.)";

constexpr const char* kStepDoc = R"(Asks all pairs that may have changed.

poses: (n, 7) or (n, 4, 4), of the bodies `numbers` (n,), or of all bodies that move, in the order of
    their numbers; None: nothing moved.

Returns a SceneStep. Raises ist.Error where more than max_pairs boxes meet.)";

}  // namespace

void add_scenes(py::module_& module) {
  py::class_<SceneAnswers> type(module, "SceneStep", "What a step of a Scene found.");
  add_column(type, "pairs", &SceneAnswers::pairs,
             "(n, 2) uint32: numbers of the bodies that meet, the lower one first, in order.");
  add_column(type, "begins", &SceneAnswers::begins,
             "(n,) bool: they did not meet in the step before.");
  add_column(type, "overlapping", &SceneAnswers::overlapping,
             "(n,) uint32, a YesNo, of pairs whose rule is 'overlap'.");
  add_inner(type, "penetration", &SceneAnswers::penetration,
            "Penetration of n rows; zero where the rule asks none.");
  add_inner(type, "separation", &SceneAnswers::separation,
            "Separation of n rows; zero where bodies overlap, or the rule has no margin.");
  add_inner(type, "impact", &SceneAnswers::impact,
            "TimeOfImpact of n rows, where the rule is 'impact'; else zero.");
  add_column(type, "ended", &SceneAnswers::ended,
             "(m, 2) uint32: pairs that met in the step before.");
  add_column(type, "refused", &SceneAnswers::refused,
             "(k,) uint32: bodies that are left out, whose pose is not usable.");
  type.def("__len__", [](const SceneAnswers& self) { return self.rows[0]; });

  py::class_<SceneHits> hits(module, "SceneHits", "What rays meet first in a Scene.");
  add_column(hits, "number", &SceneHits::number, "(n,) uint32: of the body; 0 without a hit.");
  add_inner(hits, "hit", &SceneHits::hit, "RayHits of n rows.");
  py::class_<ScenePoints> points(module, "ScenePoints", "The bodies nearest to points.");
  add_column(points, "number", &ScenePoints::number, "(n,) uint32: of the body; 0 where none is.");
  add_inner(points, "surface", &ScenePoints::surface,
            "SurfacePoints of n rows; an infinite distance where no body is near enough.");

  py::class_<PyScene>(module, "Scene", kSceneDoc)
      .def(py::new_([](std::size_t max_bodies, std::size_t max_pairs, unsigned threads) {
             SceneSettings settings;
             settings.max_bodies = max_bodies;
             settings.max_pairs = max_pairs;
             settings.patches_per_pair = 1;
             settings.workers = workers_of(threads);
             return std::make_unique<PyScene>(Scene(settings));
           }),
           py::kw_only(), py::arg("max_bodies") = 1024, py::arg("max_pairs") = 8192,
           py::arg("threads") = 0)
      .def("__len__", [](const PyScene& self) { return self.scene.size(); })
      .def("__repr__",
           [](const PyScene& self) {
             return "<ist.Scene of " + std::to_string(self.scene.size()) + " bodies>";
           })
      .def("add", add, py::arg("solid"), py::arg("pose") = py::none(), py::kw_only(),
           py::arg("scale") = 1.0, py::arg("number") = py::none(), py::arg("moves") = true,
           py::arg("group") = 0, py::arg("layers") = 1, py::arg("meets") = ~0u,
           "Adds an Asset or a Shape at a pose; None: at the origin. Returns its number: `number`, "
           "or the first that is above all others. Two bodies that do not move are not asked, nor "
           "are two "
           "Shapes. "
           "group: selects the rule of a pair. layers, meets: bits; each of a pair must be on a "
           "layer that the other meets.")
      .def(
          "remove",
          [](PyScene& self, std::uint32_t number) {
            if (!self.scene.remove(number))
              throw value_error("number: there is no body " + std::to_string(number));
            self.owners.erase(number);
          },
          py::arg("number"), "Takes a body out; its pairs end in the next step.")
      .def(
          "set_rule",
          [](PyScene& self, std::uint32_t group_a, std::uint32_t group_b, const std::string& answer,
             const std::string& measure, bool spheres_only, double margin,
             std::uint32_t pair_budget, std::uint32_t max_visits, double relative_error,
             double duration, double tolerance) {
            SceneRule rule;
            rule.impact = {duration, take_limit(tolerance, "tolerance"), max_visits};
            rule.answer = named(answer, "answer", kAnswers);
            rule.margin = take_limit(margin, "margin");
            rule.penetration =
                contact_settings(measure, spheres_only, pair_budget, max_visits, relative_error, 0);
            self.scene.set_rule(group_a, group_b, rule);
          },
          py::arg("group_a") = 0, py::arg("group_b") = 0, py::kw_only(),
          py::arg("answer") = "penetration", py::arg("measure") = "matched",
          py::arg("spheres_only") = false, py::arg("margin") = 0.0, py::arg("pair_budget") = 0,
          py::arg("max_visits") = 0, py::arg("relative_error") = 0.0, py::arg("duration") = 1.0,
          py::arg("tolerance") = 0.0,
          "How bodies of two groups are asked: 'penetration' (as ist.penetration has it), "
          "'overlap' "
          "(yes or no), 'boxes' (whether their boxes meet), 'impact' (when they meet first within "
          "`duration` [T] from now, by their motions, as ist.time_of_impact has it) or 'nothing'. "
          "margin: [u] bodies that come as near are told too, with their separation.")
      .def("set_motions", set_motions, py::arg("velocities"), py::kw_only(),
           py::arg("numbers") = py::none(), py::arg("about") = py::make_tuple(0.0, 0.0, 0.0),
           "For the rule 'impact'. velocities: (n, 6), [u/T] of the point `about` and [rad/T], "
           "world, "
           "of the bodies `numbers` (n,), or of all that move, by number. about: (3,) or (n, 3) "
           "[u] in the body's own frame, before its scale: its centre of mass if it is free.")
      .def("raycast", cast_rays, py::arg("origins"), py::arg("directions"), py::kw_only(),
           py::arg("max_distance") = std::numeric_limits<double>::infinity(),
           "The first body that each ray meets, where bodies stand now, as ist.raycast has it. "
           "Returns SceneHits. Bodies that rays do not support are passed.")
      .def("nearest", nearest, py::arg("points"), py::kw_only(),
           py::arg("max_distance") = std::numeric_limits<double>::infinity(),
           "The body nearest to each point (3,) or (n, 3) [u], where bodies stand now: that of the "
           "least signed distance. Returns ScenePoints. Bodies without a mesh are passed.")
      .def(
          "in_box",
          [](const PyScene& self, const py::object& lower, const py::object& upper) {
            const Eigen::Vector3d from = take_vector(lower, "lower"),
                                  to = take_vector(upper, "upper");
            if (!(from.array() <= to.array()).all())
              throw std::invalid_argument("in_box: lower is above upper, or NaN");
            return in_box(self, from, to).handed_out();
          },
          py::arg("lower"), py::arg("upper"),
          "(k,) uint32: bodies whose boxes meet the box from lower to upper (3,) [u].")
      .def(
          "_step_pairs",  // for ist.trimesh: (2, n), only the pairs of a step
          [](PyScene& self, const py::object& poses, const py::object& numbers) {
            const SceneStep found = ask_step(self, poses, numbers);
            if (!found.refused.empty()) throw value_error("an object reaches beyond 1e37 u");
            const std::size_t count = found.pairs.size();
            const Column<std::int64_t> out({2, count});
            for (std::size_t i = 0; i < count; ++i) {
              out.write(i, found.pairs[i].a);
              out.write(count + i, found.pairs[i].b);
            }
            return out.handed_out();
          },
          py::arg("poses"), py::arg("numbers"))
      .def("_near", near, py::arg("solids"), py::arg("poses"), py::arg("margin"))
      .def(
          "exclude",
          [](PyScene& self, std::uint32_t a, std::uint32_t b) { self.scene.exclude(a, b); },
          py::arg("a"), py::arg("b"), "Bodies that are joined do not meet, until one is removed.")
      .def(
          "include",
          [](PyScene& self, std::uint32_t a, std::uint32_t b) { self.scene.include(a, b); },
          py::arg("a"), py::arg("b"), "Takes exclude() back.")
      .def(
          "record",
          [](const PyScene& self) {
            const std::vector<std::byte> record = self.scene.record();
            return py::bytes(reinterpret_cast<const char*>(record.data()), record.size());
          },
          "bytes of what decides the next step: bodies, rules and the pairs that met, with the "
          "content hashes of assets.")
      .def_static("replay", replay, py::arg("record"), py::arg("assets"), py::kw_only(),
                  py::arg("threads") = 0,
                  "The scene that was recorded, whose next step has the same bits. assets: a list "
                  "that holds those of the record. Raises ist.Error where one is missing, naming "
                  "its content hash, or the record is none.")
      .def("step", step, py::arg("poses") = py::none(), py::kw_only(),
           py::arg("numbers") = py::none(), kStepDoc);
}

}  // namespace ist::python
