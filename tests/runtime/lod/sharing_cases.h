#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "runtime/lod/lod_sharing.h"
#include "tests/runtime/lod/lod_records.h"

/// Geometries, instances and views for tests of LodSharing.
namespace packtrace::sharing_test {

inline std::vector<LodGeometry> some_geometries(uint32_t count) {
  std::vector<LodGeometry> geometries;
  for (uint32_t i = 0; i < count; ++i) geometries.push_back(test::random_records(8 + 9 * i, i + 1).geometry());
  return geometries;
}

/// Instances with sheared, mirrored and flattened transforms, from within a few diagonals to far away.
inline std::vector<LodInstance> wild_instances(uint32_t count, uint32_t geometries, uint32_t seed) {
  test::Random random(seed);
  std::vector<LodInstance> instances;
  for (uint32_t i = 0; i < count; ++i)
    instances.push_back({random.bits() % geometries, test::random_affine(random, std::exp2(random.uniform(2, 13)))});
  return instances;
}

inline DetailView view_from(DVec3 eye, double error_px = 1.0) {
  return make_detail_view(eye, 0.01, 1.0, 1080.0, error_px);
}

inline InstanceMetric metric_of(const LodGeometry& geometry, const LodInstance& instance, const DetailView& view) {
  return {view, instance.world_from_object, largest_stretch(instance.world_from_object), geometry.reach()};
}

/// The instance's own cut, by definition.
inline std::vector<uint64_t> own_cut(const LodGeometry& geometry, const LodInstance& instance, const DetailView& view) {
  std::vector<uint64_t> passed(cut_words(geometry));
  const InstanceMetric metric = metric_of(geometry, instance, view);
  for (uint32_t rank = 0; rank < geometry.rank_count(); ++rank)
    passed[rank / 64] |= uint64_t{metric.passes(geometry.ranks(), rank)} << (rank % 64);
  return passed;
}

inline std::vector<uint64_t> used_cut(const LodSharing& sharing, const LodPlan& plan, uint32_t instance) {
  const PlannedBlas& blas = plan.blas[plan.blas_of_instance[instance]];
  return passed_of_blas(sharing.geometries()[blas.geometry], sharing.steps(blas.geometry), plan, blas);
}

} // namespace packtrace::sharing_test
