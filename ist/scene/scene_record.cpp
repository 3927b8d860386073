#include <ist/scene.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <type_traits>

#include "scene/scene_impl.h"

// Converts a scene before a step to bytes and back: pass() lists once the members to write and
// read.

namespace ist {
namespace {

static_assert(std::endian::native == std::endian::little);

struct RecordHeader {
  char magic[8] = {'i', 's', 't', '-', 's', 'c', 'n', '\0'};
  std::uint64_t version = 1;
  std::uint64_t hash = 0;  ///< XXH3-64 of the following bytes
};

[[noreturn]] void fail(const std::string& what) { throw Error("scene record: " + what); }

class Writer {
 public:
  template <class T>
  void number(const T& x) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    bytes(&x, sizeof x);
  }
  template <class E>
  void choice(const E& x, E) {
    number(x);
  }
  std::size_t count(std::size_t count, std::size_t) {
    number(std::uint64_t{count});
    return count;
  }
  void floats(const float* const& values, std::size_t count) { bytes(values, 4 * count); }
  void tree(const AssetView& tree) {
    if (tree.empty()) fail("a body without an asset cannot be recorded");
    number(tree.header().content_hash);
  }
  template <class Solid>
  void alternative(Solid&, std::size_t) {}

  std::vector<std::byte> out = std::vector<std::byte>(sizeof(RecordHeader));

 private:
  void bytes(const void* from, std::size_t size) {
    const auto* const first = static_cast<const std::byte*>(from);
    out.insert(out.end(), first, first + size);
  }
};

class Reader {
 public:
  Reader(std::span<const std::byte> bytes, std::span<const AssetView> assets,
         std::deque<std::vector<float>>& kept)
      : left_(bytes), assets_(assets), kept_(kept) {}

  template <class T>
  void number(T& x) {
    if (left_.size() < sizeof x) fail("it ends too early");
    if constexpr (std::is_same_v<T, bool>) {
      if (std::to_integer<int>(left_[0]) > 1) fail("yes or no is neither");
    }
    std::memcpy(&x, left_.data(), sizeof x);
    left_ = left_.subspan(sizeof x);
  }
  template <class E>
  void choice(E& x, E most) {
    std::underlying_type_t<E> value;
    number(value);
    if (value > static_cast<std::underlying_type_t<E>>(most)) fail("a choice is out of range");
    x = static_cast<E>(value);
  }
  /// The number of items, each of which takes at least this many bytes in the record.
  std::size_t count(std::size_t, std::size_t bytes) {
    std::uint64_t count = 0;
    number(count);
    if (count > left_.size() / bytes) fail("it ends too early");
    return count;
  }
  void floats(const float*& values, std::size_t count) {
    if (count > left_.size() / 4) fail("it ends too early");
    std::vector<float>& own = kept_.emplace_back(count);
    std::memcpy(own.data(), left_.data(), 4 * count);
    left_ = left_.subspan(4 * count);
    values = own.data();
  }
  void tree(AssetView& tree) {
    std::uint64_t hash = 0;
    number(hash);
    const auto found = std::find_if(assets_.begin(), assets_.end(), [&](const AssetView& one) {
      return !one.empty() && one.header().content_hash == hash;
    });
    if (found == assets_.end()) {
      char text[17];
      std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
      fail("the asset with the content hash " + std::string(text) + " is not among those given");
    }
    tree = *found;
  }
  /// Makes the i-th alternative of a variant.
  template <class Variant, std::size_t k = 0>
  void alternative(Variant& variant, std::size_t i) {
    if constexpr (k == std::variant_size_v<Variant>) {
      fail("a solid is of no kind");
    } else if (i == k) {
      variant.template emplace<k>();
    } else {
      alternative<Variant, k + 1>(variant, i);
    }
  }
  bool at_end() const { return left_.empty(); }

 private:
  std::span<const std::byte> left_;
  std::span<const AssetView> assets_;
  std::deque<std::vector<float>>& kept_;
};

template <class Io>
void pass(Io& io, Eigen::Vector3d& v) {
  for (double& x : v) io.number(x);
}
template <class Io>
void pass(Io& io, Pose& pose) {
  for (double& x : pose.q) io.number(x);
  for (double& x : pose.t) io.number(x);
}
template <class Io>
void pass(Io& io, Motion& motion) {
  for (auto* const v : {&motion.velocity, &motion.angular_velocity, &motion.about}) pass(io, *v);
}
template <class Io>
void pass(Io& io, SceneRule& rule) {
  io.choice(rule.answer, SceneAnswer::impact);
  io.choice(rule.penetration.measure, Measure::exact);
  io.number(rule.penetration.spheres_only);
  io.number(rule.penetration.pair_budget);
  io.number(rule.penetration.max_visits);
  io.number(rule.penetration.relative_error);
  io.number(rule.margin);
  io.number(rule.impact.duration);
  io.number(rule.impact.tolerance);
  io.number(rule.impact.max_visits);
}

template <class Io>
void pass(Io& io, HalfSpaceShape& field) {
  pass(io, field.normal);
  io.number(field.offset);
}
template <class Io>
void pass(Io& io, BoxShape& field) {
  pass(io, field.half_extents);
}
template <class Io>
void pass(Io& io, BallShape& field) {
  io.number(field.radius);
}
template <class Io, class Shape>
requires(std::is_same_v<Shape, CapsuleShape> ||
         std::is_same_v<Shape, CylinderShape>) void pass(Io& io, Shape& field) {
  io.number(field.radius);
  io.number(field.half_height);
}
template <class Io>
void pass(Io& io, HeightFieldShape& field) {
  io.number(field.columns);
  io.number(field.rows);
  for (double* const x : {&field.spacing[0], &field.spacing[1], &field.lowest, &field.highest})
    io.number(*x);
  io.floats(field.heights, std::size_t{field.columns} * field.rows);
}
template <class Io>
void pass(Io& io, DistanceGridShape& field) {
  std::size_t count = 1;
  for (std::uint32_t& size : field.size) {
    io.number(size);
    if (size > 1u << 16) fail("a grid is too large");
    count *= size;
  }
  pass(io, field.origin);
  io.number(field.spacing);
  io.number(field.error);
  io.floats(field.distances, count);
}
template <class Io>
void pass(Io&, FunctionShape&) {
  fail("a function of the caller's cannot be recorded");
}

template <class Io, class Variant>
void pass_alternative(Io& io, Variant& variant) {
  auto kind = static_cast<std::uint32_t>(variant.index());
  io.number(kind);
  io.alternative(variant, kind);
}
template <class Io>
void pass(Io& io, PlacedSolid& solid) {
  pass_alternative(io, solid.placed);
  std::visit(
      [&](auto& placed) {
        pass(io, placed.pose);
        io.number(placed.scale);
      },
      solid.placed);
  if (auto* const tree = std::get_if<PlacedAsset>(&solid.placed)) {
    io.tree(tree->asset);
  } else {
    Shape& field = std::get<PlacedShape>(solid.placed).shape;
    pass_alternative(io, field);
    std::visit([&](auto& of) { pass(io, of); }, field);
  }
}
template <class Io>
void pass(Io& io, SceneBody& body) {
  io.number(body.number);
  io.number(body.moves);
  io.number(body.group);
  io.number(body.layers);
  io.number(body.meets);
  pass(io, body.motion);
  pass(io, body.solid);
}

/// All data of a scene that determines its next step.
struct Recorded {
  SceneSettings settings;
  std::array<SceneRule, kSceneGroups * kSceneGroups> rules;
  std::vector<std::uint64_t> excluded, met;  ///< keys of pairs
  std::vector<SceneBody> bodies;
};
template <class Io>
void pass(Io& io, Recorded& all) {
  io.number(all.settings.max_pairs);
  io.number(all.settings.patches_per_pair);
  io.number(all.settings.workspace_capacity);
  for (SceneRule& rule : all.rules) pass(io, rule);
  for (auto* const keys : {&all.excluded, &all.met}) {
    keys->resize(io.count(keys->size(), sizeof(std::uint64_t)));
    for (std::uint64_t& key : *keys) io.number(key);
  }
  all.bodies.resize(io.count(all.bodies.size(), 64));
  for (SceneBody& body : all.bodies) pass(io, body);
}

/// Limits memory: no more pairs of n bodies can meet.
void limit_pairs(Recorded& all) {
  const std::size_t n = all.bodies.size();
  all.settings.max_pairs =
      std::min(all.settings.max_pairs, std::max<std::size_t>(n * (n - 1) / 2, 1));
}

}  // namespace

std::vector<std::byte> Scene::record() const {
  Impl& own = *impl_;
  Recorded all{own.settings, own.rules, own.excluded, {}, {}};
  for (const auto& two : own.now)
    if (two.meet) all.met.push_back(two.key);
  for (const std::uint32_t number : numbers()) all.bodies.push_back(*body(number));
  limit_pairs(all);
  // A filter is recorded by the pairs that it refuses now.
  if (own.filter != nullptr)
    for (std::size_t j = 0; j < all.bodies.size(); ++j)
      for (std::size_t i = 0; i < j; ++i) {
        const std::uint32_t a = all.bodies[i].number, b = all.bodies[j].number;
        if (!own.filter(own.context, a, b)) all.excluded.push_back(key_of(a, b));
      }
  std::sort(all.excluded.begin(), all.excluded.end());
  Writer writer;
  pass(writer, all);
  RecordHeader header;
  header.hash = XXH3_64bits(writer.out.data() + sizeof header, writer.out.size() - sizeof header);
  std::memcpy(writer.out.data(), &header, sizeof header);
  return std::move(writer.out);
}

Scene Scene::replay(std::span<const std::byte> record, std::span<const AssetView> assets,
                    std::size_t workers) {
  RecordHeader header;
  const RecordHeader own;
  if (record.size() < sizeof header) fail("it ends too early");
  std::memcpy(&header, record.data(), sizeof header);
  if (std::memcmp(header.magic, own.magic, sizeof own.magic) != 0) fail("it is none");
  if (header.version != own.version)
    fail("it is of another version: " + std::to_string(header.version));
  record = record.subspan(sizeof header);
  if (XXH3_64bits(record.data(), record.size()) != header.hash) fail("its content was changed");
  std::deque<std::vector<float>> kept;
  Recorded all;
  Reader reader(record, assets, kept);
  pass(reader, all);
  if (!reader.at_end()) fail("something follows it");
  const std::size_t n = all.bodies.size();
  all.settings.max_bodies = std::max<std::size_t>(n, 1);
  limit_pairs(all);
  all.settings.workers = workers;
  try {
    Scene scene(all.settings);
    for (std::uint32_t a = 0; a < kSceneGroups; ++a)
      for (std::uint32_t b = a; b < kSceneGroups; ++b)
        scene.set_rule(a, b, all.rules[a * kSceneGroups + b]);
    for (const SceneBody& body : all.bodies) scene.add(body);
    Impl& made = *scene.impl_;
    made.excluded = std::move(all.excluded);
    std::sort(made.excluded.begin(), made.excluded.end());
    std::sort(all.met.begin(), all.met.end());
    all.met.erase(std::unique(all.met.begin(), all.met.end()), all.met.end());
    // All pairs are queried again, whichever bodies these are.
    for (const std::uint64_t key : all.met)
      if (n > 0 && made.now.size() < all.settings.max_pairs)
        made.now.push_back({.key = key, .body = {0, 0}, .meet = true});
    made.recorded = std::move(kept);
    return scene;
  } catch (const std::bad_alloc&) {
    fail("its numbers ask for more memory than there is");
  }
}

}  // namespace ist
