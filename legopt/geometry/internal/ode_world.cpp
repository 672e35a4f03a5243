#include "legopt/geometry/internal/ode_world.h"

#include <ode/ode.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <string>

namespace legopt {
namespace {

constexpr std::size_t kLongestText = 512;

/// Message handler: ODE would report full contact tables and similar events on stderr, but a library must not print.
void Silence(int /*number*/, const char* /*format*/, va_list /*arguments*/) {}

/// Handler of dDebug (assertions) and dError, which abort the process if their handler returns.
[[noreturn]] void Throw(int number, const char* format, va_list arguments) {
  std::array<char, kLongestText> text{};
  if (std::vsnprintf(text.data(), text.size(), format, arguments) < 0) text.front() = '\0';
  throw OdeFailure("ODE, error " + std::to_string(number) + ": " + text.data());
}

}  // namespace

void UseOdeOnThisThread() {
  static std::once_flag process_flag;
  std::call_once(process_flag, [] {
    dSetMessageHandler(&Silence);
    dSetDebugHandler(&Throw);
    dSetErrorHandler(&Throw);
    if (dInitODE2(0) == 0) throw OdeFailure("ODE: dInitODE2 failed");
  });
  static thread_local bool ready = false;
  if (ready) return;
  if (dAllocateODEDataForThread(dAllocateMaskAll) == 0) throw OdeFailure("ODE: dAllocateODEDataForThread failed");
  ready = true;
}

namespace {

/// Parameters of the current call of the collider.
struct Request {
  double margin_m = 0.0;
  DistanceHint* hint = nullptr;
};

/// Data of a geometry of our class: a convex shape, or a search region if `set` is null.
struct ConvexData {
  const SupportSet* set;
  const Request* request;
  double bounds[6];  ///< ODE's order: min x, max x, min y, ...
};

void FillBounds(const Eigen::AlignedBox3d& box, double* bounds) {
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    bounds[2 * axis] = box.min()[axis];
    bounds[2 * axis + 1] = box.max()[axis];
  }
}

ConvexData& DataOf(dGeomID geom) { return *static_cast<ConvexData*>(dGeomGetClassData(geom)); }

void GetBounds(dGeomID geom, dReal bounds[6]) { std::copy_n(DataOf(geom).bounds, 6, bounds); }

/// Returns the support set of a geometry: our class contains it, ODE's primitives have it as user data.
const SupportSet* SetOf(dGeomID geom) {
  const bool ours = dGeomGetClass(geom) >= dFirstUserClass;
  return ours ? DataOf(geom).set : static_cast<const SupportSet*>(dGeomGetData(geom));
}

/// Collider of our class, in ODE's terms: depth = margin - signed distance, position midway between the witness
/// points.
int CollideConvex(dGeomID a, dGeomID b, int /*flags*/, dContactGeom* contact, int /*skip*/) {
  const auto [margin, hint] = *DataOf(a).request;
  PairDistance result;
  if (!SignedDistance(*SetOf(a), *SetOf(b), margin, result, hint)) return 0;
  for (int axis = 0; axis < 3; ++axis) {
    contact->pos[axis] = 0.5 * (result.point_a[axis] + result.point_b[axis]);
    contact->normal[axis] = result.normal[axis];
  }
  contact->depth = margin - result.distance_m;
  contact->g1 = a;
  contact->g2 = b;
  contact->side1 = -1;
  contact->side2 = -1;
  return 1;
}

int RefuseTrimesh(dGeomID, dGeomID, int, dContactGeom*, int) {
  std::fprintf(stderr, "collision: a convex shape met a triangle mesh; this pair must never be made\n");
  std::abort();
}

dColliderFn* ColliderAgainst(int other_class) {
  switch (other_class) {
    case dSphereClass:
    case dBoxClass:
    case dCapsuleClass:
    case dCylinderClass:
      return &CollideConvex;
    case dTriMeshClass:
      return &RefuseTrimesh;
    default:
      return other_class >= dFirstUserClass ? &CollideConvex : nullptr;
  }
}

int ConvexClass() {
  static std::once_flag flag;
  static int number = -1;
  std::call_once(flag, [] {
    const dGeomClass description = {sizeof(ConvexData), &ColliderAgainst, &GetBounds, nullptr, nullptr};
    number = dCreateGeomClass(&description);
  });
  return number;
}

dGeomID CreateConvex(const SupportSet* set, const Request* request) {
  dGeomID geom = dCreateGeom(ConvexClass());
  DataOf(geom) = ConvexData{set, request, {0, 0, 0, 0, 0, 0}};
  return geom;
}

void SetPose(dGeomID geom, const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d& r = pose.linear();
  dMatrix3 rotation = {r(0, 0), r(0, 1), r(0, 2), 0, r(1, 0), r(1, 1), r(1, 2), 0, r(2, 0), r(2, 1), r(2, 2), 0};
  dGeomSetRotation(geom, rotation);
  dGeomSetPosition(geom, pose.translation().x(), pose.translation().y(), pose.translation().z());
}

dGeomID CreateSolid(const ConvexShape& shape, const SupportSet& set, const Request* request) {
  dGeomID geom = nullptr;
  const Eigen::Vector3d& size = shape.size();
  switch (shape.kind()) {
    case ConvexShape::Kind::kHull:
      geom = CreateConvex(&set, request);
      FillBounds(shape.bounds(), DataOf(geom).bounds);
      return geom;
    case ConvexShape::Kind::kBox:
      geom = dCreateBox(nullptr, size.x(), size.y(), size.z());
      break;
    case ConvexShape::Kind::kSphere:
      geom = dCreateSphere(nullptr, size.x());
      break;
    case ConvexShape::Kind::kCapsule:
      geom = dCreateCapsule(nullptr, size.x(), size.z());
      break;
    case ConvexShape::Kind::kCylinder:
      geom = dCreateCylinder(nullptr, size.x(), size.z());
      break;
  }
  SetPose(geom, shape.pose());
  dGeomSetData(geom, const_cast<SupportSet*>(&set));  // read only, through SetOf
  return geom;
}

/// Creates a quadtree over the scene in plan, ODE's fastest space for one box against a static scene (tests/bench).
dSpaceID CreateSpace(const std::vector<ConvexShape>& solids) {
  Eigen::AlignedBox3d all(Eigen::Vector3d::Zero());
  for (const ConvexShape& solid : solids) all.extend(solid.bounds());
  const Eigen::Vector3d centre = all.center();
  const Eigen::Vector3d half = 0.5 * all.sizes() + Eigen::Vector3d::Constant(1.0);
  const dVector3 ode_centre = {centre.x(), centre.y(), centre.z(), 0};
  const dVector3 ode_half = {half.x(), half.y(), half.z(), 0};
  constexpr int kDepth = 6;
  return dQuadTreeSpaceCreate(nullptr, ode_centre, ode_half, kDepth);
}

bool Collide(dGeomID a, dGeomID b, double margin, PairDistance& result) {
  dContactGeom contact;
  if (dCollide(a, b, 1, &contact, sizeof(contact)) == 0) return false;
  result.distance_m = margin - contact.depth;
  const Eigen::Vector3d middle(contact.pos[0], contact.pos[1], contact.pos[2]);
  result.normal = Eigen::Vector3d(contact.normal[0], contact.normal[1], contact.normal[2]);
  result.point_a = middle + 0.5 * result.distance_m * result.normal;
  result.point_b = middle - 0.5 * result.distance_m * result.normal;
  return true;
}

}  // namespace

struct OdeConvexWorld::Impl {
  Request request;
  dSpaceID space = nullptr;  ///< owns the geometries of the solids
  dGeomID region = nullptr;  ///< search box
  std::vector<dGeomID> solids;
  std::vector<dGeomID> moving;
  const SupportSet* first_solid = nullptr;
  std::vector<int>* collected = nullptr;

  static void Near(void* self, dGeomID a, dGeomID b) {
    auto& impl = *static_cast<Impl*>(self);
    const SupportSet* set = SetOf(a == impl.region ? b : a);
    impl.collected->push_back(static_cast<int>(set - impl.first_solid));
  }

  ~Impl() {
    for (dGeomID geom : moving) dGeomDestroy(geom);
    if (region != nullptr) dGeomDestroy(region);
    if (space != nullptr) dSpaceDestroy(space);
  }
};

OdeConvexWorld::OdeConvexWorld(const std::vector<ConvexShape>& solids, const std::vector<SupportSet>& solid_sets,
                               const std::vector<SupportSet>& moving)
    : impl_(std::make_unique<Impl>()) {
  UseOdeOnThisThread();
  impl_->space = CreateSpace(solids);
  impl_->region = CreateConvex(nullptr, &impl_->request);
  impl_->first_solid = solid_sets.data();
  for (size_t i = 0; i < solids.size(); ++i) {
    dGeomID geom = CreateSolid(solids[i], solid_sets[i], &impl_->request);
    impl_->solids.push_back(geom);
    dSpaceAdd(impl_->space, geom);
    // Inserts the solid into the tree now. Otherwise ODE would search a linear list for each of them at the first
    // query.
    dSpaceClean(impl_->space);
  }
  for (const SupportSet& set : moving) impl_->moving.push_back(CreateConvex(&set, &impl_->request));
}

OdeConvexWorld::~OdeConvexWorld() = default;

void OdeConvexWorld::CollectSolids(const Eigen::AlignedBox3d& box, std::vector<int>& solids) {
  UseOdeOnThisThread();
  solids.clear();
  FillBounds(box, DataOf(impl_->region).bounds);
  const Eigen::Vector3d centre = box.center();
  dGeomSetPosition(impl_->region, centre.x(), centre.y(), centre.z());  // makes ODE update the bounds
  impl_->collected = &solids;
  dSpaceCollide2(impl_->region, reinterpret_cast<dGeomID>(impl_->space), impl_.get(), &Impl::Near);
  std::sort(solids.begin(), solids.end());
}

bool OdeConvexWorld::CollideWithSolid(int moving, int solid, double margin_m, PairDistance& result,
                                      DistanceHint* hint) {
  impl_->request = {margin_m, hint};
  return Collide(impl_->moving[static_cast<size_t>(moving)], impl_->solids[static_cast<size_t>(solid)], margin_m,
                 result);
}

bool OdeConvexWorld::CollideMoving(int moving_a, int moving_b, double margin_m, PairDistance& result,
                                   DistanceHint* hint) {
  impl_->request = {margin_m, hint};
  return Collide(impl_->moving[static_cast<size_t>(moving_a)], impl_->moving[static_cast<size_t>(moving_b)], margin_m,
                 result);
}

}  // namespace legopt
