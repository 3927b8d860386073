#include "ist_collision_detector.h"

#include <ist/mass_properties.h>
#include <dart/collision/CollisionFilter.hpp>
#include <dart/collision/CollisionGroup.hpp>
#include <dart/collision/CollisionObject.hpp>
#include <dart/collision/DistanceFilter.hpp>
#include <dart/common/Console.hpp>

#include <algorithm>
#include <limits>

#include "ist_shape.h"

namespace ist_dart {
namespace {

/// A shape in the world; follows its frame before each check.
class IstCollisionObject final : public dart::collision::CollisionObject {
 public:
  IstCollisionObject(dart::collision::CollisionDetector* detector,
                     const dart::dynamics::ShapeFrame* frame)
      : CollisionObject(detector, frame), solid_(placed_solid(*frame)) {}

  const PlacedSolid& solid() const { return solid_; }
  void updateEngineData() override { solid_ = placed_solid(*mShapeFrame); }

 private:
  PlacedSolid solid_;
};

const PlacedSolid& solid_of(const dart::collision::CollisionObject& object) {
  return static_cast<const IstCollisionObject&>(object).solid();
}

/// A list: the queries tell what is far apart as fast as a tree of boxes would.
class IstCollisionGroup final : public dart::collision::CollisionGroup {
 public:
  using CollisionObject = dart::collision::CollisionObject;
  using CollisionGroup::CollisionGroup;
  using CollisionGroup::updateEngineData;  // a detector calls it, no one else does

  const std::vector<CollisionObject*>& objects() const { return objects_; }

 protected:
  void initializeEngineData() override {}
  void updateCollisionGroupEngineData() override {}
  void addCollisionObjectToEngine(CollisionObject* object) override {
    if (std::find(objects_.begin(), objects_.end(), object) == objects_.end())
      objects_.push_back(object);
  }
  void addCollisionObjectsToEngine(const std::vector<CollisionObject*>& objects) override {
    for (CollisionObject* object : objects) addCollisionObjectToEngine(object);
  }
  void removeCollisionObjectFromEngine(CollisionObject* object) override {
    objects_.erase(std::remove(objects_.begin(), objects_.end(), object), objects_.end());
  }
  void removeAllCollisionObjectsFromEngine() override { objects_.clear(); }

 private:
  std::vector<CollisionObject*> objects_;
};

/// The group's objects, moved to where their frames are now.
const std::vector<dart::collision::CollisionObject*>& objects_of(
    dart::collision::CollisionGroup& group) {
  auto& ours = static_cast<IstCollisionGroup&>(group);
  ours.updateEngineData();
  return ours.objects();
}

/// Calls visit(a, b) for each pair, until it says to stop.
template <class Visit>
void each_pair(dart::collision::CollisionGroup& group, const Visit& visit) {
  const auto& objects = objects_of(group);
  for (std::size_t i = 0; i < objects.size(); ++i)
    for (std::size_t j = i + 1; j < objects.size(); ++j)
      if (visit(objects[i], objects[j])) return;
}

template <class Visit>
void each_pair(dart::collision::CollisionGroup& group1, dart::collision::CollisionGroup& group2,
               const Visit& visit) {
  const auto &objects1 = objects_of(group1), &objects2 = objects_of(group2);
  for (auto* a : objects1)
    for (auto* b : objects2)
      if (a != b && visit(a, b)) return;
}

enum class Order { unasked, as_given, swapped };

/// Calls ask(first, second, swapped), a tree second, where at least one of the two is a tree.
template <class Ask>
Order ask_pair(const PlacedSolid& a, const PlacedSolid& b, const Ask& ask) {
  const auto* tree_a = std::get_if<ist::PlacedTree>(&a);
  const auto* tree_b = std::get_if<ist::PlacedTree>(&b);
  const auto* field_a = std::get_if<ist::PlacedField>(&a);
  const auto* field_b = std::get_if<ist::PlacedField>(&b);
  if (tree_a && tree_b) return ask(*tree_a, *tree_b, false), Order::as_given;
  if (field_a && tree_b) return ask(*field_a, *tree_b, false), Order::as_given;
  if (tree_a && field_b) return ask(*field_b, *tree_a, true), Order::swapped;
  return Order::unasked;
}

/// [m] No contact of the solid is deeper; of a field without bound.
double width(const PlacedSolid& solid) {
  const auto* tree = std::get_if<ist::PlacedTree>(&solid);
  return tree ? 2 * ist::bounds(*tree).radius : std::numeric_limits<double>::infinity();
}

ist::PlacedField surface_of(const ist::PlacedTree& placed) {
  return {ist::MeshField{placed.tree}, placed.pose, placed.scale};
}

}  // namespace

IstCollisionDetector::Registrar<IstCollisionDetector> IstCollisionDetector::registrar_{
    IstCollisionDetector::getStaticType(), [] { return IstCollisionDetector::create(); }};

const std::string& IstCollisionDetector::getStaticType() {
  static const std::string type("ist");
  return type;
}

std::shared_ptr<IstCollisionDetector> IstCollisionDetector::create() {
  return std::shared_ptr<IstCollisionDetector>(new IstCollisionDetector);
}

IstCollisionDetector::IstCollisionDetector() : patches_(8) {
  mCollisionObjectManager.reset(new ManagerForSharableCollisionObjects(this));
}

std::shared_ptr<dart::collision::CollisionDetector>
IstCollisionDetector::cloneWithoutCollisionObjects() const {
  auto clone = create();
  clone->set_max_patches(max_patches());
  return clone;
}

std::unique_ptr<dart::collision::CollisionGroup> IstCollisionDetector::createCollisionGroup() {
  return std::make_unique<IstCollisionGroup>(shared_from_this());
}

std::unique_ptr<dart::collision::CollisionObject> IstCollisionDetector::createCollisionObject(
    const dart::dynamics::ShapeFrame* frame) {
  auto object = std::make_unique<IstCollisionObject>(this, frame);
  if (frame->getShape() && std::holds_alternative<std::monostate>(object->solid()))
    dterr << "[IstCollisionDetector] Shape type [" << frame->getShape()->getType()
          << "] is not supported: it meets nothing. Bake the solid and use IstShape.\n";
  return object;
}

void IstCollisionDetector::refreshCollisionObject(CollisionObject* object) {
  static_cast<IstCollisionObject*>(object)->updateEngineData();
}

void IstCollisionDetector::set_max_patches(std::size_t count) {
  patches_.resize(std::clamp<std::size_t>(count, 1, 64));
}

bool IstCollisionDetector::owns(const CollisionGroup& group, const char* what) const {
  if (group.getCollisionDetector().get() == this) return true;
  dterr << "[IstCollisionDetector::" << what << "] The collision group is of another detector.\n";
  return false;
}

void IstCollisionDetector::warn_of_fields(const CollisionObject& a, const CollisionObject& b) {
  if (warned_of_fields_) return;
  warned_of_fields_ = true;
  dtwarn << "[IstCollisionDetector] [" << a.getShape()->getType() << "] and ["
         << b.getShape()->getType() << "] do not meet: one of a pair must be an IstShape.\n";
}

bool IstCollisionDetector::collide_pair(CollisionObject* a, CollisionObject* b,
                                        const CollisionOption& option, CollisionResult* result) {
  if (option.collisionFilter && option.collisionFilter->ignoresCollision(a, b)) return false;
  const bool contacts = result != nullptr && option.enableContact;
  const PlacedSolid &solid_a = solid_of(*a), &solid_b = solid_of(*b);
  const double widest = std::min(width(solid_a), width(solid_b));
  bool met = false;
  const auto full = [&] { return result && result->getNumContacts() >= option.maxNumContacts; };
  // Inner spheres lie in their solid and touch its surface: see README.md.
  const auto add = [&](const auto& first, const ist::PlacedTree& second, bool swapped) {
    if ((met && !contacts) || full()) return;
    const std::span<ist::ContactPatch> patches(patches_.data(), contacts ? patches_.size() : 1);
    const std::size_t count =
        ist::contact_patches(first, second, {.measure = ist::Measure::inner}, scratch_, patches)
            .count;
    for (const ist::ContactPatch& patch : patches.first(count)) {
      if (patch.volume <= 0) continue;
      met = true;
      if (result == nullptr) return;
      dart::collision::Contact contact;
      contact.collisionObject1 = a;
      contact.collisionObject2 = b;
      if (contacts) {
        contact.point = patch.centroid;
        contact.penetrationDepth = patch.depth;
        // A patch's normal pushes its second solid, a contact's its first. Wholly inside, what
        // there is of a push is rounding.
        if (patch.depth < widest)
          contact.normal = swapped ? patch.normal : Eigen::Vector3d(-patch.normal);
      }
      result->addContact(contact);
      if (!contacts || full()) return;
    }
  };

  const auto* tree_a = std::get_if<ist::PlacedTree>(&solid_a);
  const auto* tree_b = std::get_if<ist::PlacedTree>(&solid_b);
  if (tree_a && tree_b && (tree_a->tree.has_field() || tree_b->tree.has_field())) {
    if (tree_a->tree.has_field()) add(surface_of(*tree_a), *tree_b, false);
    if (tree_b->tree.has_field()) add(surface_of(*tree_b), *tree_a, true);
  } else if (ask_pair(solid_a, solid_b, add) == Order::unasked) {
    warn_of_fields(*a, *b);
  }
  return met;
}

bool IstCollisionDetector::collide(CollisionGroup* group, const CollisionOption& option,
                                   CollisionResult* result) {
  if (result) result->clear();
  if (option.maxNumContacts == 0 || !owns(*group, "collide")) return false;
  bool met = false;
  each_pair(*group, [&](CollisionObject* a, CollisionObject* b) {
    met |= collide_pair(a, b, option, result);
    return result ? result->getNumContacts() >= option.maxNumContacts : met;
  });
  return met;
}

bool IstCollisionDetector::collide(CollisionGroup* group1, CollisionGroup* group2,
                                   const CollisionOption& option, CollisionResult* result) {
  if (result) result->clear();
  if (option.maxNumContacts == 0 || !owns(*group1, "collide") || !owns(*group2, "collide"))
    return false;
  bool met = false;
  each_pair(*group1, *group2, [&](CollisionObject* a, CollisionObject* b) {
    met |= collide_pair(a, b, option, result);
    return result ? result->getNumContacts() >= option.maxNumContacts : met;
  });
  return met;
}

void IstCollisionDetector::measure_pair(const CollisionObject& a, const CollisionObject& b,
                                        const DistanceOption& option, DistanceResult& nearest) {
  if (option.distanceFilter && !option.distanceFilter->needDistance(&a, &b)) return;
  ist::Separation gap;
  const Order order = ask_pair(
      solid_of(a), solid_of(b), [&](const auto& first, const ist::PlacedTree& second, bool) {
        gap = ist::separation(first, second, {}, scratch_);
        if (gap.distance <= 0 && option.enableNearestPoints)
          gap.point_a = gap.point_b = ist::penetration(first, second, {}, scratch_).centroid;
      });
  if (order == Order::unasked) return warn_of_fields(a, b);
  if (nearest.found() && gap.distance >= nearest.unclampedMinDistance) return;
  nearest.unclampedMinDistance = gap.distance;
  nearest.minDistance = std::max(gap.distance, option.distanceLowerBound);
  nearest.shapeFrame1 = a.getShapeFrame();
  nearest.shapeFrame2 = b.getShapeFrame();
  if (!option.enableNearestPoints) return;
  nearest.nearestPoint1 = order == Order::as_given ? gap.point_a : gap.point_b;
  nearest.nearestPoint2 = order == Order::as_given ? gap.point_b : gap.point_a;
}

double IstCollisionDetector::distance(CollisionGroup* group, const DistanceOption& option,
                                      DistanceResult* result) {
  DistanceResult nearest;
  if (owns(*group, "distance"))
    each_pair(*group, [&](CollisionObject* a, CollisionObject* b) {
      measure_pair(*a, *b, option, nearest);
      return nearest.found() && nearest.unclampedMinDistance <= option.distanceLowerBound;
    });
  if (result) *result = nearest;
  return nearest.minDistance;
}

double IstCollisionDetector::distance(CollisionGroup* group1, CollisionGroup* group2,
                                      const DistanceOption& option, DistanceResult* result) {
  DistanceResult nearest;
  if (owns(*group1, "distance") && owns(*group2, "distance"))
    each_pair(*group1, *group2, [&](CollisionObject* a, CollisionObject* b) {
      measure_pair(*a, *b, option, nearest);
      return nearest.found() && nearest.unclampedMinDistance <= option.distanceLowerBound;
    });
  if (result) *result = nearest;
  return nearest.minDistance;
}

ist::Penetration IstCollisionDetector::penetration(const dart::dynamics::ShapeFrame& a,
                                                   const dart::dynamics::ShapeFrame& b) {
  ist::Penetration overlap;
  ask_pair(placed_solid(a), placed_solid(b),
           [&](const auto& first, const ist::PlacedTree& second, bool) {
             overlap = ist::penetration(first, second, {}, scratch_);
           });
  return overlap;
}

}  // namespace ist_dart
