#include "support/extremes.h"

#include "support/extreme_boxes.h"

namespace ist::testing {

const std::vector<Extreme>& extremes() {
  static const std::vector<Extreme> all = {
      {"SmallObjects", "Boxes of size 1e-9 u", [] { return Boxes(1e-9).answers(1); }},
      {"LargeObjects", "Boxes of size 1e9 u", [] { return Boxes(1e9).answers(2); }},
      {"FarObjects", "Boxes 1e7 sizes from their origins", [] { return Boxes(1, 1e7).answers(3); }},
      {"SmallFarObjects", "Boxes of size 1e-9 u, 1e7 sizes from their origins",
       [] { return Boxes(1e-9, 1e7).answers(4); }},
      {"LargeFarObjects", "Boxes of size 1e9 u, 1e7 sizes from their origins",
       [] { return Boxes(1e9, 1e7).answers(5); }},
      {"SizeRatio", "A a million times the size of B", of_size_ratio},
      {"Needle", "Needle, 1e6 : 1, along an axis",
       [] {
         return of_thin_box({0.5, 5e-7, 5e-7}, false);
       }},
      {"TurnedNeedle", "Needle, 1e6 : 1, askew",
       [] {
         return of_thin_box({0.5, 5e-7, 5e-7}, true);
       }},
      {"Plate", "Plate, 1 × 1 × 1e-6, along the axes",
       [] {
         return of_thin_box({0.5, 0.5, 5e-7}, false);
       }},
      {"TurnedPlate", "Plate, 1 × 1 × 1e-6, askew",
       [] {
         return of_thin_box({0.5, 0.5, 5e-7}, true);
       }},
      {"Crack", "Cube with a crack, 1e-7 of its size wide", of_crack},
      {"TouchingShells", "Shells of one mesh that share a face", of_touching_shells},
      {"TouchingFaces", "Two cubes face to face, no gap", of_touching_faces},
      {"CoincidentCopies", "An object and its copy at the same pose", of_coincident_copies},
      {"HalfTurns", "Rotations by π, about axes and diagonals", of_half_turns},
      {"LooseQuaternions", "Quaternions 1e-7 off unit length", of_loose_quaternions},
      {"UniformScales", "Uniform scales 1e-6 … 1e6 of both", of_uniform_scales},
  };
  return all;
}

}  // namespace ist::testing
