#include <ist/query.h>

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "query/base/members.h"
#include "support/query_settings.h"
#include "support/random_assets.h"
#include "support/test_meshes.h"

// Any pose, scale and limits: the answer is not NaN, lies between its ends, and is the same when
// asked again.

namespace {

using namespace ist;

/// Numbers from the input; zeros once it has ended.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  template <class T>
  T next() {
    T value{};
    const std::size_t n = std::min(left_, sizeof(T));
    if (n > 0) std::memcpy(&value, data_, n);
    data_ += n;
    left_ -= n;
    return value;
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

Pose next_pose(Input& input) {
  Pose pose;
  // Bytes rarely make a unit quaternion: half of the poses are made from directions instead.
  const bool any = input.next<std::uint8_t>() % 2 == 0;
  double norm = 0;
  for (double& q : pose.q) {
    q = any ? input.next<double>() : input.next<std::int8_t>() / 127.0;
    norm += q * q;
  }
  if (!any && norm > 0)
    for (double& q : pose.q) q /= std::sqrt(norm);
  for (double& t : pose.t) t = any ? input.next<double>() : input.next<std::int16_t>() / 16384.0;
  return pose;
}

void require(bool holds) {
  if (!holds) std::abort();
}

void look_at(const Penetration& answer) {
  if (answer.status == QueryStatus::invalid_input) {
    require(std::isnan(answer.volume) && answer.centroid.array().isNaN().all());
    return;
  }
  require(answer.volume >= 0);
  require(answer.volume_min <= answer.volume);
  require(answer.volume <= answer.volume_max);
  require(!answer.force.hasNaN() && !answer.torque.hasNaN());
  require(!answer.centroid.hasNaN());
}

bool same_bits(const Penetration& a, const Penetration& b) {
  if (a.status == QueryStatus::invalid_input) return b.status == a.status;
  bool same = true;
  ist::for_each_member([&](const auto& x, const auto& y) { same = same && x == y; }, a, b);
  return same;
}

/// The same poses and scales of two meshes.
void ask_exact(PlacedAsset a, PlacedAsset b, bool copies, std::uint32_t max_visits,
               Workspace& workspace) {
  static const Asset ball = bake_mesh_only(close_mesh(testing::icosphere_mesh(2), "ball"));
  static const Asset cube = bake_mesh_only(close_mesh(testing::cube_mesh(), "cube"));
  a.asset = ball.view();
  b.asset = (copies ? ball : cube).view();
  PenetrationSettings settings{.measure = Measure::exact};
  settings.max_visits = max_visits;
  const Penetration answer = penetration(a, b, settings, workspace);
  if (answer.status == QueryStatus::budget_exhausted) {
    require(answer.volume_min == 0 && answer.volume_max > 0);
    return;
  }
  require(answer.status != QueryStatus::missing_data);
  look_at(answer);
  require(same_bits(answer, penetration(a, b, settings, workspace)));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Asset a = testing::make_random_asset(
      {.spheres = 300, .smallest = 0.2, .centre = {}, .exponent = 0, .details = 2}, 1);
  static const Asset b = testing::make_random_asset(
      {.spheres = 40, .smallest = 0.05, .centre = {}, .exponent = 0, .details = 1}, 2);
  static Workspace large(1u << 16), small(64);
  Input input(data, size);
  const auto flags = input.next<std::uint8_t>();
  PenetrationSettings settings;
  settings.measure = (flags & 1) != 0 ? Measure::inner : Measure::matched;
  if ((flags & 2) != 0) settings.max_visits = input.next<std::uint8_t>();
  if ((flags & 4) != 0) settings.relative_error = input.next<double>();
  Workspace& workspace = (flags & 16) != 0 ? small : large;
  PlacedAsset placed_a{a.view(), next_pose(input), 1}, placed_b{b.view(), next_pose(input), 1};
  if ((flags & 32) != 0) placed_b.scale = input.next<double>();
  if ((flags & 64) != 0) placed_a.scale = input.next<float>();
  if ((flags & 128) != 0) placed_b.asset = a.view();
  settings.pair_budget = input.next<std::uint16_t>();
  if (input.next<std::uint8_t>() % 2 == 1)
    ask_exact(placed_a, placed_b, (flags & 128) != 0, settings.max_visits, workspace);

  const auto [penetration, separation] =
      query(placed_a, placed_b, ist::testing::for_both(settings), workspace);
  look_at(penetration);
  if (settings.measure == Measure::matched && settings.pair_budget == 0)
    look_at(without_protrusion(penetration, placed_a, placed_b));
  require(separation.status == QueryStatus::invalid_input
              ? std::isnan(separation.distance)
              : separation.distance_min >= 0 && separation.distance_min <= separation.distance_max);
  require(same_bits(
      penetration,
      query(placed_a, placed_b, ist::testing::for_both(settings), workspace).penetration));
  return 0;
}
