#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <ist/field.h>
#include <ist/query.h>
#include <ist/response.h>

#include <array>
#include <cstddef>
#include <span>

// The contact of two of Bullet's objects, of which at least one is an IstShape.

/// How contacts are found and what they do. The same for all pairs of a world.
struct IstSettings {
  static constexpr std::size_t kPatches = ist::ContactMemory::kPatches;

  enum class Response {
    solver,  ///< patches are springs among the contact points of Bullet's solver
    wrench,  ///< the force of `law` is applied in the tick, Bullet sees no contact
  };
  Response response = Response::solver;
  std::size_t patches = 8;  ///< [1, kPatches] a contact
  ist::ContactSettings query;

  /// Its stiffness is the pressure over depth in both ways. The solver takes it implicitly, at any
  /// size, and needs no more of it; the wrench is bound to what the step bears.
  /// With an area of reference every wrench is one patch. The coefficient of friction is Bullet's,
  /// of the two bodies.
  ist::ContactLaw law;
  /// [s] ≥ 0, solver only: a contact's damper over its spring, about the time in which it settles.
  double relaxation = 0;
  /// [u] ≥ 0, solver only: two objects are asked about again once a point of one has moved by more
  /// than this against the other. Until then their patches move along, as much deeper as that
  /// motion makes them, of the same areas. A contact that begins is seen this late.
  /// 0: asked in every step.
  double follow = 0;
};

/// Who is A and who is B to ist, and where they are.
struct IstPair {
  const btCollisionObject* a = nullptr;
  const btCollisionObject* b = nullptr;  ///< always an IstShape
  ist::PlacedTree tree_b;
};

/// Either order. Both null if neither is an IstShape; `tree_b` is not set.
IstPair pair_of(const btCollisionObject& first, const btCollisionObject& second);

/// [u] No point of pair.b has moved by more than this against pair.a since its transform there was
/// `before`.
double largest_motion(const IstPair& pair, const btTransform& before, const btTransform& now);

/// A shape that ist can meet: an IstShape, or a plane, box, ball or IstTerrain as a field.
bool is_known(const btCollisionShape& shape);

/// Fills `patches`; `whole` is the contact as one. The normals push pair.b.
struct IstContact {
  IstPair pair;
  ist::Penetration whole;
  std::size_t count = 0;
  /// [u] Of objects that do not touch: nor do they while no point has moved by more than this.
  double clearance = 0;
  std::array<ist::ContactPatch, IstSettings::kPatches> patches;
};

/// The contact of two objects at their transforms of now. Either order; false if neither is an
/// IstShape or one is not known.
bool find_contact(const btCollisionObject& first, const btCollisionObject& second,
                  std::size_t patches, const ist::ContactSettings& settings,
                  ist::Workspace& workspace, IstContact& contact);
