#include "app/field_spec.h"

#include <fmt/format.h>
#include <ist/types.h>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "library/settings/numbers.h"

namespace ist::app {
namespace {

using Eigen::Vector3d;

/// Numbers of a kind of field, as a user writes them.
struct Kind {
  const char* name;
  std::vector<const char*> numbers;
  const char* meaning;
};

const std::array<Kind, 5>& kinds() {
  static const std::array<Kind, 5> all = {
      Kind{"plane",
           {"nx", "ny", "nz", "d"},
           "the solid n · x ≤ d: an outward normal n of any length above 0 and d"},
      Kind{"box", {"hx", "hy", "hz"}, "half extents above 0"},
      Kind{"ball", {"r"}, "a radius above 0"},
      Kind{"capsule",
           {"r", "h"},
           "a radius above 0 and the half height, 0 or more, of the segment along z"},
      Kind{"cylinder", {"r", "h"}, "a radius and a half height along z, above 0"}};
  return all;
}

const Kind* kind_of(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return nullptr;
  const std::string_view name = text.substr(0, colon);
  for (const Kind& kind : kinds())
    if (name == kind.name) return &kind;
  return nullptr;
}

/// A description, and what its errors say.
class Spec {
 public:
  Spec(const std::string& text, const Kind& kind) : text_(text), kind_(kind) {
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

  /// [u] above 0, or from 0 on.
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
  static constexpr double kLongest = 1e150;  // [u] what the queries take

  [[noreturn]] void fail(const std::string& fault) const {
    throw Error(fmt::format("'{}' is not a {}: {}; write {}:{}, {}", text_, kind_.name, fault,
                            kind_.name, fmt::join(kind_.numbers, ","), kind_.meaning));
  }

  const std::string& text_;
  const Kind& kind_;
  std::vector<double> values_;
};

}  // namespace

bool is_field_spec(const std::string& text) { return kind_of(text) != nullptr; }

Shape parse_field(const std::string& text) {
  const Kind* const kind = kind_of(text);
  if (kind == nullptr) throw Error("'" + text + "' does not describe a field");
  const Spec spec(text, *kind);
  const std::string_view name = kind->name;
  if (name == "plane") return spec.plane();
  if (name == "box") return BoxShape{Vector3d(spec.length(0), spec.length(1), spec.length(2))};
  if (name == "ball") return BallShape{spec.length(0)};
  if (name == "capsule") return CapsuleShape{spec.length(0), spec.length(1, true)};
  return CylinderShape{spec.length(0), spec.length(1)};
}

}  // namespace ist::app
