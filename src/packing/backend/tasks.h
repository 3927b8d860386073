#pragma once

#include <span>
#include <vector>

#include "mesh/hierarchy/line_lattice.h"

// Tasks for a backend other than packing, and their results: plain data in the solid's unit frame.

namespace ist {

/// The division of a solid into columns along x: column (i, j) stands for `step_y` × `step_z` of
/// cross-section (docs/design.md 5, 1). Row j is shifted along y by an irrational part of the step,
/// so that no straight edge of the solid aligns with the lattice, and every row still has exactly
/// one column in each step of the box.
struct ColumnPlan {
  LineLattice lines;
  double x0 = 0, x1 = 0;  ///< extent of the solid, unit frame

  double cross_section() const { return lines.step_y * lines.step_z; }  ///< unit frame²
};

/// A site of a power diagram: x belongs to the site of smallest |x − c|² − weight.
struct PowerSite {
  double x = 0, y = 0, z = 0;  ///< centre c, unit frame
  double weight = 0;           ///< ρ², squared radius, unit frame²
};

/// Sites to be relaxed within a solid's columns.
struct RelaxTask {
  ColumnPlan columns;
  std::span<const PowerSite> sites;
  double volume = 0;  ///< of the solid, unit frame³
};

/// Sites after relaxation and their shares of the volume; none if columns cannot measure the solid.
struct RelaxedSites {
  std::vector<PowerSite> sites;
  std::vector<double> shares;
};

/// A ball that may be enlarged.
struct CoverBall {
  double x = 0, y = 0, z = 0;
  double radius = 0;  ///< unit frame, before extension
};

/// Balls that must cover the solid.
struct CoverTask {
  std::span<const CoverBall> balls;  ///< radius: of the sphere, before enlargement
  double slack = 0;                  ///< enlargement of every ball, unit frame
  double middle[3] = {};             ///< of the first cell, unit frame
  double half = 0;                   ///< its half edge
};

}  // namespace ist
