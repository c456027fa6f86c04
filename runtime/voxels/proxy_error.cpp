#include "runtime/voxels/proxy_error.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "runtime/ao/ao_integrator.h"

namespace packtrace {

double proxy_error(const SceneSource& source, const RayTracer& exact, const RayTracer& proxies, const GBuffer& seen,
                   const AoConfig& config) {
  constexpr size_t kPixels = 256;
  constexpr uint16_t kRays = 128;
  std::vector<size_t> hits;
  for (size_t i = 0; i < seen.instance.size(); ++i)
    if (seen.instance[i] != kNoInstance) hits.push_back(i);
  const size_t count = std::min(hits.size(), kPixels);
  if (count == 0) return 0.0;
  std::vector<size_t> chosen;
  for (size_t k = 0; k < count; ++k) chosen.push_back(hits[(2 * k + 1) * hits.size() / (2 * count)]);
  const std::vector<uint32_t> first(seen.instance.size(), 0);
  std::vector<uint16_t> rays(seen.instance.size(), 0);
  for (const size_t pixel : chosen) rays[pixel] = kRays;
  const SamplePlan plan{0, 0, {}, first, rays};
  const auto traced = [&](const RayTracer& tracer) {
    AoFrame frame;
    Progress unseen;
    trace_ao(source, tracer, seen, config, plan, frame, unseen);
    return frame.ao;
  };
  const std::vector<float> with = traced(proxies), without = traced(exact);
  double sum = 0.0;
  for (const size_t pixel : chosen) sum += std::abs(double{with[pixel]} - double{without[pixel]});
  return sum / static_cast<double>(count);
}

} // namespace packtrace
