#include "mesh/resolve/arrangement.h"

#include <algorithm>
#include <cmath>
#include <deque>

namespace ist {
namespace {

constexpr std::uint32_t after(std::uint32_t k) { return k == 2 ? 0 : k + 1; }
constexpr std::uint32_t before(std::uint32_t k) { return k == 0 ? 2 : k - 1; }

}  // namespace

PlanarTriangulation::PlanarTriangulation(const ExactPoints& points, int axis,
                                         const std::array<std::uint32_t, 3>& frame,
                                         const std::vector<std::uint32_t>& inner)
    : points_(points), axis_(axis), frame_(frame) {
  cells_.resize(1);
  set(0, {frame, {kNoIndex, kNoIndex, kNoIndex}});
  for (const std::uint32_t p : inner) insert_point(p);
}

void PlanarTriangulation::set(std::uint32_t cell, const Cell& value) {
  cells_[cell] = value;
  for (const std::uint32_t p : value.corner) cell_at_[p] = cell;
}

/// Replaces the neighbour beyond one of the cell's sides.
void PlanarTriangulation::hand_over(std::uint32_t cell, std::uint32_t from, std::uint32_t to) {
  if (cell == kNoIndex) return;
  std::replace(cells_[cell].beyond.begin(), cells_[cell].beyond.end(), from, to);
}

/// The cell that contains p, by a randomised walk, which terminates.
std::uint32_t PlanarTriangulation::cell_of(std::uint32_t p) {
  for (auto at = static_cast<std::uint32_t>(cells_.size() - 1);;) {
    random_ = random_ * 6364136223846793005 + 1442695040888963407;
    std::uint32_t k = static_cast<std::uint32_t>(random_ >> 33) % 3, tried = 0;
    const Cell& cell = cells_[at];
    while (tried < 3 && turn(cell.corner[after(k)], cell.corner[before(k)], p) >= 0) {
      k = after(k);
      ++tried;
    }
    if (tried == 3) return at;
    at = cell.beyond[k];
  }
}

void PlanarTriangulation::insert_point(std::uint32_t p) {
  const std::uint32_t at = cell_of(p);
  const auto [a, b, c] = cells_[at].corner;
  const auto [beyond_a, beyond_b, beyond_c] = cells_[at].beyond;
  const auto second = static_cast<std::uint32_t>(cells_.size()), third = second + 1;
  cells_.resize(cells_.size() + 2);
  set(at, {{a, b, p}, {second, third, beyond_c}});
  set(second, {{b, c, p}, {third, at, beyond_a}});
  set(third, {{c, a, p}, {at, second, beyond_b}});
  hand_over(beyond_a, at, second);
  hand_over(beyond_b, at, third);
  // p is on a side: the cell between the side and p is flat.
  for (const std::uint32_t flat : {at, second, third}) {
    const Cell cell = cells_[flat];
    if (turn(cell.corner[0], cell.corner[1], p) == 0) return flip({flat, 2});
  }
}

/// Replaces the edge opposite to a corner by the quadrilateral's other diagonal.
void PlanarTriangulation::flip(const Place edge) {
  const std::uint32_t t = edge.cell, u = cells_[t].beyond[edge.corner], i = edge.corner;
  if (u == kNoIndex) throw Unresolvable{"a point lies on the border of a triangulation"};
  const Cell one = cells_[t], two = cells_[u];
  const std::uint32_t j = two.beyond[0] == t ? 0 : two.beyond[1] == t ? 1 : 2;
  const std::uint32_t p = one.corner[i], a = one.corner[after(i)], b = one.corner[before(i)];
  const std::uint32_t q = two.corner[j];
  const std::uint32_t past_pa = one.beyond[before(i)], past_bp = one.beyond[after(i)];
  const std::uint32_t past_aq = two.beyond[after(j)], past_qb = two.beyond[before(j)];
  set(t, {{p, a, q}, {past_aq, u, past_pa}});
  set(u, {{q, b, p}, {past_bp, t, past_qb}});
  hand_over(past_aq, u, t);
  hand_over(past_bp, t, u);
}

/// True if the two cells at an edge form a strictly convex quadrilateral.
bool PlanarTriangulation::can_flip(const Place edge) const {
  const Cell& cell = cells_[edge.cell];
  const std::uint32_t u = cell.beyond[edge.corner];
  if (u == kNoIndex) return false;
  const Cell& other = cells_[u];
  const std::uint32_t j = other.beyond[0] == edge.cell ? 0 : other.beyond[1] == edge.cell ? 1 : 2;
  const std::uint32_t p = cell.corner[edge.corner], q = other.corner[j];
  return turn(p, cell.corner[after(edge.corner)], q) > 0 &&
         turn(q, cell.corner[before(edge.corner)], p) > 0;
}

PlanarTriangulation::Place PlanarTriangulation::place_of(std::uint32_t corner) const {
  const std::uint32_t cell = cell_at_.at(corner);
  const auto& corners = cells_[cell].corner;
  return {cell, corners[0] == corner ? 0u : corners[1] == corner ? 1u : 2u};
}

/// The next cell about a corner, counter-clockwise.
PlanarTriangulation::Place PlanarTriangulation::next_about(const Place place) const {
  const std::uint32_t corner = cells_[place.cell].corner[place.corner];
  const std::uint32_t next = cells_[place.cell].beyond[after(place.corner)];
  const auto& corners = cells_[next].corner;
  return {next, corners[0] == corner ? 0u : corners[1] == corner ? 1u : 2u};
}

/// The edge ab; no cell if there is none. `a` must not be a point of the frame. Searches about the
/// end with fewer edges, unless b is in the frame.
PlanarTriangulation::Place PlanarTriangulation::edge_between(std::uint32_t a,
                                                             std::uint32_t b) const {
  const Place about_a = place_of(a), about_b = place_of(b);
  Place at = about_a, at_b = about_b;
  do {
    if (cells_[at.cell].corner[after(at.corner)] == b) return {at.cell, before(at.corner)};
    at = next_about(at);
    if (is_frame(b)) continue;
    if (cells_[at_b.cell].corner[before(at_b.corner)] == a) return {at_b.cell, after(at_b.corner)};
    at_b = next_about(at_b);
    if (at_b.cell == about_b.cell) break;
  } while (at.cell != about_a.cell);
  return {kNoIndex, 0};
}

void PlanarTriangulation::insert(std::uint32_t from, std::uint32_t to, int step, std::size_t of) {
  const bool up = from < to;
  const auto [known, fresh] = steps_.try_emplace(key(std::min(from, to), std::max(from, to)));
  known->second[of] += up ? step : -step;
  if (!fresh || edge_between(from, to).cell != kNoIndex) return;
  // The edges that the segment crosses, from one end to the other.
  Place at = place_of(from);
  while (!(turn(from, cells_[at.cell].corner[after(at.corner)], to) > 0 &&
           turn(from, cells_[at.cell].corner[before(at.corner)], to) < 0))
    at = next_about(at);
  std::deque<std::array<std::uint32_t, 2>> crossed;
  for (;;) {
    const std::uint32_t right = cells_[at.cell].corner[after(at.corner)],
                        left = cells_[at.cell].corner[before(at.corner)];
    crossed.push_back({right, left});
    const std::uint32_t u = cells_[at.cell].beyond[at.corner];
    const auto& corners = cells_[u].corner;
    // The next side of u: opposite to its corner that the segment passes.
    const std::uint32_t ahead = corners[0] != right && corners[0] != left   ? 0u
                                : corners[1] != right && corners[1] != left ? 1u
                                                                            : 2u;
    if (corners[ahead] == to) break;
    // With the tip on the left, the segment leaves opposite to the old left corner.
    const std::uint32_t passed = turn(from, to, corners[ahead]) > 0 ? left : right;
    at = {u, corners[0] == passed ? 0u : corners[1] == passed ? 1u : 2u};
  }
  // S. W. Sloan, "A fast algorithm for generating constrained Delaunay triangulations", 1993.
  while (!crossed.empty()) {
    auto [a, b] = crossed.front();
    crossed.pop_front();
    if (is_frame(a)) std::swap(a, b);
    const Place edge = edge_between(a, b);
    if (!can_flip(edge)) {
      crossed.push_back({a, b});
      continue;
    }
    const std::uint32_t p = cells_[edge.cell].corner[edge.corner];
    flip(edge);
    const std::uint32_t q = cells_[edge.cell].corner[2];  // after flip()
    if (p == from || p == to || q == from || q == to) continue;
    if (turn(from, to, p) != turn(from, to, q)) crossed.push_back({p, q});
  }
}

bool PlanarTriangulation::is_segment(const Place edge) const {
  const std::uint32_t a = cells_[edge.cell].corner[after(edge.corner)],
                      b = cells_[edge.cell].corner[before(edge.corner)];
  return steps_.contains(key(std::min(a, b), std::max(a, b)));
}

/// True if the point opposite to an edge lies well within the circle through the cell's corners. In
/// double: errors only make the triangulation worse, never wrong.
bool PlanarTriangulation::is_sharp(const Place edge) const {
  const Cell &cell = cells_[edge.cell], &other = cells_[cell.beyond[edge.corner]];
  const std::uint32_t j = other.beyond[0] == edge.cell ? 0 : other.beyond[1] == edge.cell ? 1 : 2;
  const int x = (axis_ + 1) % 3, y = (axis_ + 2) % 3;
  const Eigen::Vector3d& d = points_.rounded(other.corner[j]);
  double px[3], py[3], square[3], determinant = 0, magnitude = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& p = points_.rounded(cell.corner[k]);
    px[k] = p[x] - d[x];
    py[k] = p[y] - d[y];
    square[k] = px[k] * px[k] + py[k] * py[k];
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = (k + 1) % 3, l = (k + 2) % 3;
    determinant += square[k] * (px[i] * py[l] - px[l] * py[i]);
    magnitude += square[k] * (std::abs(px[i] * py[l]) + std::abs(px[l] * py[i]));
  }
  return determinant > 1e-9 * magnitude;
}

void PlanarTriangulation::make_round() {
  std::vector<Place> edges;
  for (std::uint32_t cell = 0; cell < cells_.size(); ++cell)
    for (std::uint32_t k = 0; k < 3; ++k) edges.push_back({cell, k});
  for (std::size_t left = 20 * edges.size(); !edges.empty() && left > 0; --left) {
    const Place edge = edges.back();
    edges.pop_back();
    const std::uint32_t u = cells_[edge.cell].beyond[edge.corner];
    if (u == kNoIndex || is_segment(edge) || !is_sharp(edge) || !can_flip(edge)) continue;
    flip(edge);
    for (const std::uint32_t cell : {edge.cell, u})
      for (const std::uint32_t k : {0u, 1u, 2u}) edges.push_back({cell, k});
  }
}

std::vector<PlanarTriangulation::Covered> PlanarTriangulation::covered() const {
  constexpr std::array<int, 2> kUnknown = {INT_MAX, INT_MAX}, kNothing = {0, 0};
  std::vector<std::array<int, 2>> winding(cells_.size(), kUnknown);
  std::vector<std::uint32_t> reached = {cell_at_.at(frame_[0])};
  winding[reached[0]] = kNothing;
  while (!reached.empty()) {
    const std::uint32_t cell = reached.back();
    reached.pop_back();
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t u = cells_[cell].beyond[k];
      if (u == kNoIndex || winding[u] != kUnknown) continue;
      // The cell is on the left of a → b, u on the right.
      const std::uint32_t a = cells_[cell].corner[after(k)], b = cells_[cell].corner[before(k)];
      const auto step = steps_.find(key(std::min(a, b), std::max(a, b)));
      winding[u] = winding[cell];
      for (std::size_t of = 0; of < 2 && step != steps_.end(); ++of)
        winding[u][of] -= a < b ? step->second[of] : -step->second[of];
      reached.push_back(u);
    }
  }
  std::vector<Covered> result;
  for (std::size_t cell = 0; cell < cells_.size(); ++cell)
    if (winding[cell] != kNothing) result.push_back({cells_[cell].corner, winding[cell]});
  return result;
}

}  // namespace ist
