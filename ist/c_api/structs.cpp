#include "c_api/structs.h"

namespace ist::c_api {
ist_status_t read(const ist_penetration_settings_t* given, PenetrationSettings& settings) noexcept {
  if (given == nullptr) return IST_OK;
  if (given->size != sizeof *given) return IST_WRONG_SIZE;
  if (given->measure < IST_MATCHED || given->measure > IST_EXACT) return IST_INVALID_INPUT;
  settings.measure = static_cast<Measure>(given->measure);
  settings.spheres_only = given->spheres_only != 0;
  settings.pair_budget = given->pair_budget;
  settings.max_visits = given->max_visits;
  settings.relative_error = given->relative_error;
  settings.pair_id = given->pair_id;
  return IST_OK;
}

ist_status_t read(const ist_separation_settings_t* given, SeparationSettings& settings) noexcept {
  if (given == nullptr) return IST_OK;
  if (given->size != sizeof *given) return IST_WRONG_SIZE;
  settings.max_visits = given->max_visits;
  settings.inner_spheres = given->inner_spheres != 0;
  settings.max_distance = given->max_distance;
  settings.pair_id = given->pair_id;
  return IST_OK;
}

ist_status_t read(const ist_impact_settings_t* given, ImpactSettings& settings) noexcept {
  if (given == nullptr) return IST_OK;
  if (given->size != sizeof *given) return IST_WRONG_SIZE;
  if (given->duration == 0) return IST_NO_DURATION;  // still zero as initialised
  settings.duration = given->duration;
  settings.tolerance = given->tolerance;
  settings.max_visits = given->max_visits;
  return IST_OK;
}

namespace {

ShapeSample sample(const void* context, const Eigen::Vector3d& x) noexcept {
  const auto& function = static_cast<const ist_shape_t*>(context)->as.function;
  ist_shape_sample_t answer = {};
  function.sample(function.context, x.data(), &answer);
  return {answer.distance, vector(answer.gradient)};
}

ist_status_t read(const ist_shape_t& given, Shape& field) noexcept {
  switch (given.kind) {
    case IST_HALF_SPACE:
      field = HalfSpaceShape{vector(given.as.half_space.normal), given.as.half_space.offset};
      return IST_OK;
    case IST_BOX:
      field = BoxShape{vector(given.as.box.half_extents)};
      return IST_OK;
    case IST_BALL:
      field = BallShape{given.as.ball.radius};
      return IST_OK;
    case IST_CAPSULE:
      field = CapsuleShape{given.as.capsule.radius, given.as.capsule.half_height};
      return IST_OK;
    case IST_CYLINDER:
      field = CylinderShape{given.as.cylinder.radius, given.as.cylinder.half_height};
      return IST_OK;
    case IST_HEIGHTS: {
      const auto& from = given.as.heights;
      if (from.heights == nullptr) return IST_NULL_POINTER;
      HeightFieldShape heights{
          from.heights, from.columns, from.rows, {from.spacing[0], from.spacing[1]}};
      if (from.lowest != 0 || from.highest != 0) {
        heights.lowest = from.lowest;
        heights.highest = from.highest;
      }
      field = heights;
      return IST_OK;
    }
    case IST_DISTANCE_GRID: {
      const auto& from = given.as.distance_grid;
      if (from.distances == nullptr) return IST_NULL_POINTER;
      field = DistanceGridShape{from.distances,
                                {from.points[0], from.points[1], from.points[2]},
                                vector(from.origin),
                                from.spacing,
                                from.error};
      return IST_OK;
    }
    case IST_FUNCTION:
      if (given.as.function.sample == nullptr) return IST_NULL_POINTER;
      field = FunctionShape{sample, &given, given.as.function.error};
      return IST_OK;
    default:
      return IST_INVALID_INPUT;
  }
}

}  // namespace

ist_status_t read(const ist_placed_t* given, PlacedAsset& placed) noexcept {
  ist_status_t status = check_size(given);
  if (status != IST_OK) return status;
  if (given->shape != nullptr)
    status = given->asset == nullptr ? IST_MISSING_DATA : IST_INVALID_INPUT;
  if (status == IST_OK) status = view_of(given->asset, placed.asset);
  placed.pose = pose(given->pose);
  placed.scale = given->scale == 0 ? 1 : given->scale;
  return status;
}

ist_status_t read(const ist_placed_t* given, PlacedSolid& placed) noexcept {
  PlacedAsset tree;
  ist_status_t status = read(given, tree);
  if (status == IST_OK) placed = tree;
  if (status != IST_MISSING_DATA) return status;
  PlacedShape field{{}, tree.pose, tree.scale};
  status = check_size(given->shape);
  if (status == IST_OK) status = read(*given->shape, field.shape);
  if (status == IST_OK) placed = field;
  return status;
}

}  // namespace ist::c_api
