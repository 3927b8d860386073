#pragma once

#include <Eigen/Core>
#include <charconv>
#include <cstddef>
#include <string>

namespace ist {

/// The shortest text that reads back as the same number.
inline std::string shortest(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

/// "(x y z)".
inline std::string position_text(const Eigen::Vector3d& p) {
  std::string text = "(";
  text += shortest(p[0]) + " " + shortest(p[1]) + " " + shortest(p[2]) + ")";
  return text;
}

/// "1 hole", "3 holes".
inline std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}
inline std::string counted(std::size_t count, const std::string& noun) {
  return counted(count, noun, noun + "s");
}

}  // namespace ist
