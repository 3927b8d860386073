#pragma once

#include <cstddef>
#include <functional>

#include <ist/api.h>

namespace IST_API ist {

/// State of a long offline stage.
struct Progress {
  /// "polygonise", "resolve", "pack", "calibrate", "cover", "tree", "predict"
  const char* stage = "";
  std::size_t spheres = 0;  ///< count so far
  double coverage = 0;      ///< [0, 1] of the solid's volume in inner spheres; "pack" only
  double radius = 0;        ///< [u] of the spheres being inserted now; "pack" only
  double fraction = 0;      ///< [0, 1] of this stage's work, an estimate
  double elapsed = 0;       ///< [s] since the stage began
};

/// The progress callback. It is called from the thread that started the stage: when packing and
/// predicting begin and then at most ten times a second, and after every step of the shorter
/// stages.
///
/// Return false to cancel: packing ends with what is packed so far, which is valid; other stages
/// throw Error. An exception in the callback ends the stage and reaches the caller.
using ProgressCallback = std::function<bool(const Progress&)>;

}  // namespace ist
