#include "query/field/surface_descent.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "query/descent/answer.h"
#include "query/probe/membership.h"

namespace ist {
namespace {

// What is not opened may be in or out.
constexpr double kUnknownShare = 0.5;

/// The balls of a surface as a tree whose spheres are blocks of triangles.
SphereTree tree_of(const SurfaceTree& surface, const TreeHeader& header) {
  SphereTree tree(header);
  for (int k = 1; k <= surface.top; ++k)
    tree.level[k - 1] = {surface.level[k].balls, surface.level[k].origins, nullptr,
                         surface.level[k].count};
  return tree;
}

TreeHeader header_of(const SurfaceTree& surface) {
  TreeHeader header;
  header.sphere_count = surface.level[0].count;
  header.level_count = static_cast<std::uint32_t>(surface.top);
  const FieldHeader& field = *surface.header;
  double square = 0;
  for (int k = 0; k < 3; ++k) {
    const double half = 0.5 * field.cell * static_cast<double>(kBrickWidth * field.bricks[k]);
    header.root[k] = field.low[k] + half;
    square += half * half;
  }
  header.root[3] = std::sqrt(square);
  return header;
}

/// Cube of the typical radius of a surface's nodes: they tile an area.
double typical_cube(const SphereTree& balls, int level) {
  const double count = balls.count(level);
  const double r = balls.header->root[3];
  return r * r * r / (count * std::sqrt(count));
}

}  // namespace

SurfaceDescent::SurfaceDescent(const SurfaceTree& surface, const SphereTree& probes,
                               const RelativePose& pose, const DescentLimits& limits,
                               Workspace::Impl& scratch, ContactBins* bins) noexcept
    : surface_(surface),
      probes_(probes),
      pose_(pose),
      map_(pose.a_from_b),
      ball_header_(header_of(surface)),
      balls_(tree_of(surface, ball_header_)),
      precision_(precision_for(balls_, probes, pose)),
      limits_(limits),
      min_radius_(limits.min_radius / pose.unit_a),
      scratch_(scratch),
      bins_(bins),
      budget_(limits),
      surface_level_(balls_.top),
      probe_level_(probes.top) {}

void SurfaceDescent::run() noexcept {
  PairList& now = scratch_.now;
  now.a[0] = now.b[0] = 0;
  now.size = 1;
  scratch_.patches->forget();
  while (now.size > 0 && (surface_level_ > kSphereLevel || probe_level_ > 0)) {
    const double cube = map_.scale * map_.scale * map_.scale;
    const bool open_surface_now =
        probe_level_ == 0 ||
        (surface_level_ > kSphereLevel &&
         typical_cube(balls_, surface_level_) >= cube * probes_.typical_cube(probe_level_));
    if (min_radius_ > 0) drop_small();
    if (limits_.relative_error > 0 && total_.overlap.volume + held_.cubes[0] > 0) {
      const double undecided = waiting() + unopened_;
      if (undecided <= limits_.relative_error * (overlap().volume + undecided)) {
        leave(0);
        return;
      }
    }
    if (!(open_surface_now ? open_surface() : open_probes())) {
      leave(0);
      return;
    }
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
    if (n == 0) return false;
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
  const NodeStage stage{&probes_,       &balls_, probe_level_, surface_level_, &pose_.b_from_a,
                        precision_};
  std::uint16_t* const masks = scratch_.masks.get();
  std::size_t wanted = 0;
  for (std::size_t done = 0; done < now.size;) {
    const std::size_t n = budget_.grant(std::min(kNodePairs, now.size - done));
    if (n == 0) return false;
    reach_masks(stage, now.b.get() + done, now.a.get() + done, n, masks + done);
    for (std::size_t i = done; i < done + n; ++i)
      wanted += static_cast<std::size_t>(std::popcount(masks[i]));
    done += n;
  }
  if (wanted > scratch_.capacity) return false;
  next.size = 0;
  for (std::size_t from = 0; from < now.size;) {
    const std::size_t end = group_end(from);
    const std::uint32_t first = kWidth * now.b[from];
    std::uint32_t met = 0;
    for (std::size_t i = from; i < end; ++i) met |= masks[i];
    const std::uint32_t used = std::min(kWidth, probes_.count(probe_level_ - 1) - first);
    for (std::uint32_t lane = 0; lane < used; ++lane) {
      if ((met >> lane & 1) == 0) {
        settle(probe_level_ - 1, first + lane);
        continue;
      }
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

void SurfaceDescent::settle(int level, std::uint32_t block) noexcept {
  const NodeBall ball = probes_.ball(level, block);
  double centre[3];
  map_.apply(ball.centre, centre);
  if (!inside_surface(surface_, centre)) return;
  settled_level_ = level;
  settled_[settled_count_++] = block;
  if (settled_count_ == kSettled || bins_ != nullptr) flush();
}

void SurfaceDescent::flush() noexcept {
  if (settled_count_ == 0) return;
  add_subtrees(probes_, settled_level_, settled_, settled_count_, held_);
  if (bins_ != nullptr) {
    SubtreeSums sums;
    add_subtrees(probes_, settled_level_, settled_, 1, sums);
    bins_->add_guess(0, 0, settled_level_, settled_[0], whole_spheres(sums, map_));
  }
  settled_count_ = 0;
}

void SurfaceDescent::sum_leaves() noexcept {
  const PairList& now = scratch_.now;
  const bool by_error = limits_.relative_error > 0;
  double left = by_error ? waiting() : 0;
  for (std::size_t from = 0; from < now.size;) {
    const std::size_t end = group_end(from);
    const std::size_t granted = budget_.grant(end - from);
    if (granted < end - from) {
      budget_.give_back(granted);
      leave(from);
      return;
    }
    if (by_error && left + unopened_ <=
                        limits_.relative_error * (overlap().volume + left + unopened_)) {
      leave(from);
      return;
    }
    const ProbeTotal part = sum_block(now.b[from], from, end);
    total_.add(part);
    if (bins_ != nullptr) bins_->add_guess(0, 0, 0, now.b[from], part.overlap);
    if (by_error)
      left -= probes_.sums(0, now.b[from]).volume * (map_.scale * map_.scale * map_.scale);
    from = end;
  }
}

ProbeTotal SurfaceDescent::sum_block(std::uint32_t block, std::size_t from,
                                     std::size_t to) noexcept {
  ProbeBalls balls;
  place_probes(probes_, block, map_, balls);
  ProbeSums sums;
  for (std::size_t i = from; i < to; ++i)
    add_patch(scratch_.patches->find(surface_, scratch_.now.a[i]), balls, sums);
  pairs_ += sums.pairs;
  return total_of(balls, sums, map_.t,
                  [&](const double(&x)[3]) { return inside_surface(surface_, x); });
}

double SurfaceDescent::waiting() const noexcept {
  const PairList& now = scratch_.now;
  double sum = 0;
  for (std::size_t from = 0; from < now.size; from = group_end(from))
    sum += probes_.sums(probe_level_, now.b[from]).volume;
  return sum * (map_.scale * map_.scale * map_.scale);
}

void SurfaceDescent::drop_small() noexcept {
  PairList& now = scratch_.now;
  const double cube = map_.scale * map_.scale * map_.scale;
  std::size_t kept = 0;
  for (std::size_t from = 0; from < now.size;) {
    const std::size_t end = group_end(from);
    if (probes_.ball(probe_level_, now.b[from]).r * map_.scale < min_radius_) {
      unopened_ += probes_.sums(probe_level_, now.b[from]).volume * cube;
      stopped_ = true;
      from = end;
      continue;
    }
    for (; from < end; ++from, ++kept) {
      now.a[kept] = now.a[from];
      now.b[kept] = now.b[from];
    }
  }
  now.size = kept;
}

void SurfaceDescent::leave(std::size_t from) noexcept {
  const PairList& now = scratch_.now;
  const double cube = map_.scale * map_.scale * map_.scale;
  for (; from < now.size; from = group_end(from))
    unopened_ += probes_.sums(probe_level_, now.b[from]).volume * cube;
  stopped_ = true;
}

Overlap SurfaceDescent::overlap() const noexcept {
  Overlap sum = total_.overlap;
  sum.add(whole_spheres(held_, map_));
  return sum;
}

Penetration SurfaceDescent::penetration() const noexcept {
  Overlap sum = overlap();
  // Both surfaces lie within the field's error of each other; centres are rounded too.
  const double off = surface_.header->error + distance_error(Precision::float64, span(balls_, probes_, pose_));
  sum.error = 2 * off * total_.area + 1e-13 * (total_.crossed + sum.volume);
  const double scale = map_.scale;
  const double most = probes_.header->volume_sum * (scale * scale * scale) * (1 + 1e-9);
  const double lowest = std::max(0.0, sum.volume - sum.error);
  const double highest =
      std::max(lowest, std::min(most, sum.volume + sum.error + unopened_));
  if (unopened_ > 0) {
    // The push grows with the volume, as far as anybody can tell.
    const double guess = kUnknownShare * unopened_;
    if (sum.volume > 0) sum.scale(1 + guess / sum.volume);
    else sum.volume = guess;
  }
  Penetration result = world_answer(sum, lowest, highest, pose_);
  result.node_visits = budget_.visits();
  result.sphere_pairs = pairs_ + held_.spheres;
  if (stopped_) result.status = QueryStatus::budget_exhausted;
  return result;
}

}  // namespace ist
