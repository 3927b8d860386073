// A lower bound of the distance of boxes of two meshes, once for lanes of the CPU and for a thread
// of the GPU. This is not a header of its own. IST_FORMULA precedes a function, and `Of` defines
// its numbers: V, lanes of numbers T or a single one, with set(), magnitude(), lesser(), greater()
// and all().

template <class V>
struct LaneBox {
  V low[3], high[3], normal[3], slab_low, slab_high;
};

/// The relative error of a formula.
template <class T>
constexpr double kGapRounding = sizeof(T) == sizeof(float) ? 2e-6 : 1e-14;

/// `squared`: a lower bound of the squared distance from `one`. `apart`: the largest gap along any
/// axis, negative if the boxes overlap along all of them. False if the first axes prove that all
/// boxes are `beyond`; then neither is set.
template <class Of, class S>
IST_FORMULA bool measure_boxes(const BoxLook<typename Of::T, S>& look, const SeenBox<S>& one,
                               const LaneBox<typename Of::V>& box, typename Of::V beyond,
                               typename Of::V& squared, typename Of::V& apart) {
  using T = typename Of::T;
  using V = typename Of::V;
  const auto set = [](S x) { return Of::set(static_cast<T>(x)); };
  constexpr S kLength = S(1 - 1e-5);  // a lower bound of normals' lengths in float
  constexpr S kDirectionLength = sizeof(T) == sizeof(float) ? kLength : S(1 - 1e-14);
  const V zero = set(0), half_one = set(S(0.5));
  V away[3], half[3];
  V along = zero, across = zero, largest = set(S(-1e30));
  const auto squared_gap = [&](V gap) {
    largest = Of::greater(largest, gap);
    const V positive = Of::greater(zero, gap);
    return positive * positive;
  };
  for (int i = 0; i < 3; ++i) {
    const V x = box.low[i], y = box.high[i];
    away[i] = half_one * (x + y) - set(one.middle[i]);
    half[i] = half_one * (y - x);
    along = along + squared_gap(Of::magnitude(away[i]) - (half[i] + set(one.hull[i])));
  }
  const auto times = [&](const T(&u)[3], const V(&x)[3]) {
    return (Of::set(u[0]) * x[0] + Of::set(u[1]) * x[1]) + Of::set(u[2]) * x[2];
  };
  // Distances perpendicular to the direction, by boxes.
  V beside = zero;
  for (int j = 0; j < 2; ++j) {
    beside = beside + squared_gap(Of::magnitude(times(look.lane_direction[1 + j], away)) -
                                  (times(look.abs_direction[1 + j], half) + set(one.across[j])));
  }
  const V ahead = times(look.lane_direction[0], away) + times(look.abs_direction[0], half);
  const V box_ahead =
      Of::greater(zero, set(kDirectionLength * one.nearest) - set(kDirectionLength) * ahead);
  const V by_boxes = Of::greater(along, box_ahead * box_ahead + beside);
  if (Of::all(by_boxes > beyond)) return false;
  for (int k = 0; k < 3; ++k) {
    across = across + squared_gap(Of::magnitude(times(look.lane_axis[k], away)) -
                                  (times(look.abs_axis[k], half) + set(one.reach[k])));
  }
  // n is `turn` times the other normal plus a remainder, along which only boxes are known.
  const V(&n)[3] = box.normal;
  const V turn =
      (n[0] * set(one.normal[0]) + n[1] * set(one.normal[1])) + n[2] * set(one.normal[2]);
  const V steep = times(look.lane_direction[0], n);
  V at_middle = zero, at_box = zero, other_at_box = zero, to_box = zero, of_slab = zero;
  V rest[3];
  for (int i = 0; i < 3; ++i) {
    const V across_slab = Of::set(look.lane_direction[0][i]) - steep * n[i];
    of_slab = of_slab + (across_slab * away[i] + Of::magnitude(across_slab) * half[i]);
    rest[i] = n[i] - turn * set(one.normal[i]);
    const V other_rest = set(one.normal[i]) - turn * n[i];
    at_middle = at_middle + n[i] * set(one.middle[i]);
    other_at_box = other_at_box + Of::magnitude(other_rest) * half[i];
    to_box = to_box + other_rest * away[i];
  }
  for (int k = 0; k < 3; ++k)
    at_box = at_box + set(one.reach[k]) * Of::magnitude(times(look.lane_axis[k], rest));
  // Along n, from the middle of `one`: its extent, and the lane's slab.
  const V slab_low = box.slab_low - at_middle, slab_high = box.slab_high - at_middle;
  const V turn_low = turn * set(one.low), turn_high = turn * set(one.high);
  const V of_low = turn * slab_low, of_high = turn * slab_high;
  const V gap = Of::greater(slab_low - (Of::greater(turn_low, turn_high) + at_box),
                            (Of::lesser(turn_low, turn_high) - at_box) - slab_high);
  const V other_gap =
      Of::greater(set(one.low) - ((to_box + Of::greater(of_low, of_high)) + other_at_box),
                  ((to_box + Of::lesser(of_low, of_high)) - other_at_box) - set(one.high));
  const V slab = Of::greater(zero, Of::greater(gap, other_gap) - set(3 * look.blur));
  of_slab = of_slab + Of::greater(steep * slab_low, steep * slab_high);
  const V ahead_gap =
              squared_gap(set(kDirectionLength) * (set(one.nearest) - Of::lesser(ahead, of_slab))),
          slab_gap = set(kLength) * slab;
  apart = largest;
  squared =
      Of::greater(Of::greater(along, across), Of::greater(slab_gap * slab_gap, ahead_gap + beside));
  return true;
}
