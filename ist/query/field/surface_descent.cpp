#include "query/field/surface_descent.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "query/probe/membership.h"

namespace ist {
namespace {

// Triangles of a block, or a ball that is to be placed, up to which each is looked at with all of
// sixteen balls.
constexpr int kFewInBlock = 4;

/// Cube of the typical radius of a surface's nodes: they tile an area.
double typical_cube(const SphereTree& balls, int level) {
  const double count = balls.count(level);
  const double r = balls.header->root[3];
  return r * r * r / (count * std::sqrt(count));
}

}  // namespace

SphereTree ball_tree(const SurfaceTree& surface, const TreeHeader& header) {
  SphereTree tree(header);
  for (int k = 1; k <= surface.top; ++k)
    tree.level[k - 1] = {surface.level[k].balls, surface.level[k].origins, nullptr,
                         surface.level[k].count};
  return tree;
}

TreeHeader ball_header(const SurfaceTree& surface) {
  TreeHeader header;
  header.sphere_count = surface.level[0].count;
  header.level_count = static_cast<std::uint32_t>(surface.top);
  const SurfaceHeader& grid = *surface.header;
  double square = 0;
  for (int k = 0; k < 3; ++k) {
    const double half = 0.5 * grid.cell * static_cast<double>(kBrickWidth * grid.bricks[k]);
    header.root[k] = grid.low[k] + half;
    square += half * half;
  }
  header.root[3] = std::sqrt(square);
  return header;
}

bool opens_surface(const SphereTree& balls, int surface_level, const SphereTree& probes,
                   int probe_level, double scale) noexcept {
  return probe_level == 0 || (surface_level > kSphereLevel &&
                              typical_cube(balls, surface_level) >=
                                  scale * scale * scale * probes.typical_cube(probe_level));
}

SurfaceDescent::SurfaceDescent(const SurfaceTree& surface, const SphereTree& probes,
                               const RelativePose& pose, const DescentLimits& limits,
                               Workspace::Impl& scratch, ContactBins* bins) noexcept
    : surface_(surface),
      probes_(probes),
      pose_(pose),
      map_(pose.a_from_b),
      ball_header_(ball_header(surface)),
      balls_(ball_tree(surface, ball_header_)),
      precision_(precision_for(balls_.root(), probes.root(), pose.a_from_b.scale)),
      scratch_(scratch),
      budget_(limits.max_visits),
      surface_level_(balls_.top),
      probe_level_(probes.top),
      tally_(probes, pose, bins) {}

void SurfaceDescent::run() noexcept {
  PairList& now = scratch_.now;
  now.a[0] = now.b[0] = 0;
  now.size = 1;
  scratch_.patches->forget();
  while (now.size > 0 && (surface_level_ > kSphereLevel || probe_level_ > 0)) {
    const bool open_surface_now =
        opens_surface(balls_, surface_level_, probes_, probe_level_, map_.scale);
    if (!(open_surface_now ? open_surface() : open_probes())) return;
  }
  if (now.size > 0) sum_leaves();
}

std::size_t SurfaceDescent::group_end(std::size_t from) const noexcept {
  const PairList& now = scratch_.now;
  std::size_t end = from + 1;
  while (end < now.size && now.b[end] == now.b[from]) ++end;
  return end;
}

bool SurfaceDescent::open_surface() noexcept {
  PairList& now = scratch_.now;
  PairList& next = scratch_.next;
  const NodeStage stage{&balls_, &probes_, surface_level_, probe_level_, &map_, precision_};
  next.size = 0;
  for (std::size_t done = 0; done < now.size;) {
    const std::size_t room = (scratch_.capacity - next.size) / kWidth;
    const std::size_t n = budget_.grant(std::min({kNodePairs, now.size - done, room}));
    if (n == 0) {
      leave(0);
      return false;
    }
    next.size += open_nodes(stage, now.a.get() + done, now.b.get() + done, n,
                            next.a.get() + next.size, next.b.get() + next.size);
    done += n;
  }
  // Nodes of B whose partners are all gone.
  std::size_t left = 0;
  for (std::size_t from = 0; from < now.size; from = group_end(from)) {
    const std::uint32_t block = now.b[from];
    if (left < next.size && next.b[left] == block) {
      while (left < next.size && next.b[left] == block) ++left;
    } else {
      settle(probe_level_, block);
    }
  }
  flush();
  --surface_level_;
  std::swap(now, next);
  return true;
}

bool SurfaceDescent::open_probes() noexcept {
  PairList& now = scratch_.now;
  PairList& next = scratch_.next;
  if (surface_level_ != kSphereLevel) {
    if (!reach_children()) {
      leave(0);
      return false;
    }
  }
  std::uint16_t* const masks = scratch_.masks.get();
  next.size = 0;
  for (std::size_t from = 0; from < now.size;) {
    const std::size_t end = group_end(from);
    if (kWidth * (end - from) > scratch_.capacity - next.size) {
      leave_both(from);
      return false;
    }
    if (surface_level_ == kSphereLevel && !budget_.grant_all(end - from)) {
      leave_both(from);
      return false;
    }
    const std::uint32_t first = kWidth * now.b[from];
    const std::uint32_t used =
        (1u << std::min(kWidth, probes_.count(probe_level_ - 1) - first)) - 1;
    const std::uint32_t met =
        surface_level_ == kSphereLevel ? sort_children(from, end, used) : used & any_of(from, end);
    if (surface_level_ != kSphereLevel)
      for (std::uint32_t left = used & ~met; left != 0; left &= left - 1)
        settle(probe_level_ - 1, first + static_cast<std::uint32_t>(std::countr_zero(left)));
    for (std::uint32_t left = met; left != 0; left &= left - 1) {
      const auto lane = static_cast<std::uint32_t>(std::countr_zero(left));
      for (std::size_t i = from; i < end; ++i) {
        next.a[next.size] = now.a[i];
        next.b[next.size] = first + lane;
        next.size += masks[i] >> lane & 1;
      }
    }
    from = end;
  }
  flush();
  --probe_level_;
  std::swap(now, next);
  return true;
}

bool SurfaceDescent::reach_children() noexcept {
  const PairList& now = scratch_.now;
  const NodeStage stage{&probes_,       &balls_,         probe_level_,
                        surface_level_, &pose_.b_from_a, precision_};
  for (std::size_t done = 0; done < now.size;) {
    const std::size_t n = budget_.grant(std::min(kNodePairs, now.size - done));
    if (n == 0) return false;
    reach_masks(stage, now.b.get() + done, now.a.get() + done, n, scratch_.masks.get() + done);
    done += n;
  }
  return true;
}

std::uint32_t SurfaceDescent::any_of(std::size_t from, std::size_t to) const noexcept {
  std::uint32_t any = 0;
  for (std::size_t i = from; i < to; ++i) any |= scratch_.masks[i];
  return any;
}

std::uint32_t SurfaceDescent::sort_children(std::size_t from, std::size_t to,
                                            std::uint32_t used) noexcept {
  const PairList& now = scratch_.now;
  std::uint16_t* const masks = scratch_.masks.get();
  const std::uint32_t block = now.b[from];
  ProbeBalls balls;
  place_probes(probes_, probe_level_, block, map_, balls);
  std::uint32_t met = 0;
  int count = 0;  // of triangles that come near
  for (std::size_t i = from; i < to; ++i) {
    const SurfacePatch& patch = scratch_.patches->find(surface_, now.a[i]);
    const std::uint32_t near = triangles_near(patch, balls.origin, balls.reach);
    masks[i] = 0;
    if (near == 0) continue;
    count += std::popcount(near);
    masks[i] = static_cast<std::uint16_t>(used & (std::popcount(near) <= kFewInBlock
                                                      ? balls_near(patch, near, balls)
                                                      : near_block(balls, now.a[i])));
    met |= masks[i];
  }
  if (count == 0) {
    settle(probe_level_, block);
    return 0;
  }
  const std::uint32_t alone = used & ~met;
  if (alone == 0) return met;
  if (count > kFewInBlock * std::popcount(alone)) {
    for (std::uint32_t left = alone; left != 0; left &= left - 1)
      settle(probe_level_ - 1, kWidth * block + static_cast<std::uint32_t>(std::countr_zero(left)));
  } else {
    settle_children(balls, block, alone, from, to);
  }
  return met;
}

double SurfaceDescent::clear_radius(int level, std::uint32_t block) const noexcept {
  // Partners are those of every ancestor's ball, beyond which a node's own ball may reach.
  const NodeBall ball = probes_.ball(level, block);
  const Eigen::Vector3d centre(ball.centre[0], ball.centre[1], ball.centre[2]);
  double radius = ball.r;
  for (int above = level + 1; above <= probes_.top; ++above) {
    block /= kWidth;
    const NodeBall outer = probes_.ball(above, block);
    const Eigen::Vector3d middle(outer.centre[0], outer.centre[1], outer.centre[2]);
    radius = std::min(radius, outer.r - (centre - middle).norm());
  }
  return std::max(0.0, radius) * map_.scale * (1 - 1e-12);
}

void SurfaceDescent::settle(int level, std::uint32_t block) noexcept {
  const NodeBall ball = probes_.ball(level, block);
  double centre[3];
  map_.apply(ball.centre, centre);
  if (inside_surface(surface_, centre, clear_radius(level, block))) keep(level, block);
}

void SurfaceDescent::settle_children(const ProbeBalls& balls, std::uint32_t block,
                                     std::uint32_t children, std::size_t from,
                                     std::size_t to) noexcept {
  // One of them is looked up, the others are reached from it.
  const auto first = static_cast<std::size_t>(std::countr_zero(children));
  const double start[3] = {balls.origin[0] + balls.x[first], balls.origin[1] + balls.y[first],
                           balls.origin[2] + balls.z[first]};
  std::uint32_t inside = 0;
  const auto named = kWidth * block + static_cast<std::uint32_t>(first);
  if (inside_surface(surface_, start, clear_radius(probe_level_ - 1, named))) inside = children;
  if (!std::has_single_bit(children)) {
    for (std::size_t i = from; i < to; ++i) {
      const SurfacePatch& patch = scratch_.patches->find(surface_, scratch_.now.a[i]);
      const std::uint32_t near = triangles_near(patch, balls.origin, balls.reach);
      if (near != 0) inside ^= odd_ways(patch, near, start, balls, children);
    }
  }
  for (std::uint32_t left = inside & children; left != 0; left &= left - 1)
    keep(probe_level_ - 1, kWidth * block + static_cast<std::uint32_t>(std::countr_zero(left)));
}

void SurfaceDescent::keep(int level, std::uint32_t block) noexcept {
  if (level != settled_level_) flush();
  settled_level_ = level;
  settled_[settled_count_++] = block;
  if (settled_count_ == kSettled || tally_.has_bins()) flush();
}

void SurfaceDescent::flush() noexcept {
  if (settled_count_ == 0) return;
  tally_.hold(settled_level_, settled_, settled_count_);
  settled_count_ = 0;
}

void SurfaceDescent::sum_leaves() noexcept {
  const PairList& now = scratch_.now;
  for (std::size_t from = 0; from < now.size;) {
    const std::size_t end = group_end(from);
    if (!budget_.grant_all(end - from)) {
      leave(from);
      return;
    }
    tally_.add(now.b[from], sum_block(now.b[from], from, end));
    from = end;
  }
}

ProbeTotal SurfaceDescent::sum_block(std::uint32_t block, std::size_t from,
                                     std::size_t to) noexcept {
  ProbeBalls balls;
  place_probes(probes_, 0, block, map_, balls);
  ProbeSums sums;
  const std::uint32_t used =
      (1u << std::min(kWidth, probes_.header->sphere_count - kWidth * block)) - 1;
  std::uint16_t* const near = scratch_.masks.get();
  int count = 0;  // of triangles that come near
  for (std::size_t i = from; i < to; ++i) {
    const std::uint32_t a = scratch_.now.a[i];
    const SurfacePatch& patch = scratch_.patches->find(surface_, a);
    near[i] = static_cast<std::uint16_t>(triangles_near(patch, balls.origin, balls.reach));
    if (near[i] == 0) continue;
    count += std::popcount(near[i]);
    const std::uint32_t chosen =
        std::popcount(near[i]) <= kFewInBlock ? used : used & near_block(balls, a);
    if (chosen != 0) add_patch(patch, near[i], balls, chosen, sums);
  }
  tally_.count(sums.pairs);
  if (count == 0) {
    const bool all = inside_surface(surface_, balls.origin, clear_radius(0, block));
    return total_of(balls, sums, all ? used : 0, map_.t);
  }
  const ProbeBalls seen = off_edges(balls, sums, [&](const ProbeBalls& moved, ProbeSums& there) {
    for (std::size_t i = from; i < to; ++i) {
      const SurfacePatch& patch = scratch_.patches->find(surface_, scratch_.now.a[i]);
      near[i] = static_cast<std::uint16_t>(triangles_near(patch, moved.origin, moved.reach));
      if (near[i] != 0) add_patch(patch, near[i], moved, sums.on_edge, there);
    }
  });
  std::uint32_t inside;
  const std::uint32_t told = told_sides(sums, inside);
  if (const std::uint32_t untold = used & ~told; untold != 0)
    inside |= untold & sides(seen, untold, sums.met, told, inside, count, from, to);
  return total_of(balls, sums, inside, map_.t);
}

std::uint32_t SurfaceDescent::near_block(const ProbeBalls& balls, std::uint32_t a) const noexcept {
  if (balls_.top < 0) return 0xffff;
  const NodeBall ball = balls_.ball(kSphereLevel, a);
  return balls_within(balls, ball.centre, ball.r);
}

std::uint32_t SurfaceDescent::sides(const ProbeBalls& balls, std::uint32_t wanted,
                                    std::uint32_t met, std::uint32_t told, std::uint32_t inside,
                                    int triangles, std::size_t from,
                                    std::size_t to) const noexcept {
  const auto centre_of = [&](std::size_t i, double(&x)[3]) {
    x[0] = balls.origin[0] + balls.x[i];
    x[1] = balls.origin[1] + balls.y[i];
    x[2] = balls.origin[2] + balls.z[i];
  };
  double x[3];
  std::uint32_t result = 0;
  if (triangles > kFewInBlock * std::popcount(wanted)) {
    for (std::uint32_t left = wanted; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(left));
      centre_of(i, x);
      const bool clear = (met >> i & 1) == 0;
      if (inside_surface(surface_, x, clear ? balls.r[i] * (1 - 1e-12) : 0)) result |= 1u << i;
    }
    return result;
  }
  // From a centre whose side is known, through the triangles between.
  const auto known = static_cast<std::size_t>(std::countr_zero(told != 0 ? told : wanted));
  centre_of(known, x);
  const bool here = told != 0 ? (inside >> known & 1) != 0 : inside_surface(surface_, x, 0);
  result = here ? 0xffff : 0;
  for (std::size_t i = from; i < to; ++i)
    if (scratch_.masks[i] != 0)
      result ^= odd_ways(scratch_.patches->find(surface_, scratch_.now.a[i]), scratch_.masks[i], x,
                         balls, wanted);
  return result;
}

void SurfaceDescent::leave(std::size_t from) noexcept {
  const PairList& now = scratch_.now;
  for (; from < now.size; from = group_end(from)) tally_.leave(probe_level_, now.b[from]);
}

void SurfaceDescent::leave_both(std::size_t from) noexcept {
  flush();
  leave(from);
  std::swap(scratch_.now, scratch_.next);
  --probe_level_;
  leave(0);
}

Penetration SurfaceDescent::penetration() const noexcept {
  // Both surfaces lie within the stored error of each other; centres are rounded too.
  const double off =
      surface_.header->error +
      distance_error(Precision::float64, span(balls_.root(), probes_.root(), pose_.a_from_b));
  return tally_.answer(off, budget_.visits());
}

}  // namespace ist
