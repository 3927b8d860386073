#pragma once

#include <cmath>

#include "base/host_device.h"

namespace ist {

/// A point or vector of the unit frame, in float, for host and device code.
struct Float3 {
  float x = 0, y = 0, z = 0;
};

IST_HD inline Float3 operator+(Float3 a, Float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
IST_HD inline Float3 operator-(Float3 a, Float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
IST_HD inline Float3 operator*(float s, Float3 a) { return {s * a.x, s * a.y, s * a.z}; }
IST_HD inline float dot(Float3 a, Float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
IST_HD inline float norm(Float3 a) { return sqrtf(dot(a, a)); }

}  // namespace ist
