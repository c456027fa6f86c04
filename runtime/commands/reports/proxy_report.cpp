#include "runtime/commands/reports/proxy_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "runtime/commands/reports/file_report.h"

namespace packtrace {
namespace {

const char* surface_of(const ProxySummary& use) {
  if ((use.flags & voxels::kMatched) != 0) return "matched";
  return (use.flags & voxels::kThin) != 0 ? "thin" : "conservative";
}

double per_diagonal(const ProxySummary& use, double error) { return error / (use.edge * std::sqrt(3.0)); }

const char* sign_of(const ProxySummary& use) {
  if ((use.flags & voxels::kSigned) != 0) return "signed";
  return (use.flags & voxels::kClosedSource) != 0 ? "unsigned: parts are thinner than a voxel"
                                                  : "unsigned: the geometry is open";
}

std::string field_line(const ProxySummary& use) {
  return fmt::format(grouped(),
                     "proxy {}: distance field {} x {} x {}, {}, edge {:.4g}; {:L} samples stored in {:L} bits, error "
                     "{:.3g} within {} voxels of the surface\n",
                     use.name.empty() ? "(no name)" : use.name, use.size[0], use.size[1], use.size[2], sign_of(use),
                     use.edge, use.stored_voxels, use.bits, use.surface_error, voxels::kFieldBand);
}

std::string line_of(const ProxySummary& use) {
  if (use.kind == voxels::kFieldProxy) return field_line(use);
  std::string text = fmt::format(
      grouped(),
      "proxy {}: voxels {} x {} x {}, {}{}, edge {:.4g}; {:L} voxels in {:L} bits ({:.2f} per "
      "voxel, index {:L})",
      use.name.empty() ? "(no name)" : use.name, use.size[0], use.size[1], use.size[2], surface_of(use),
      (use.flags & voxels::kFilled) != 0 ? " and filled" : "", use.edge, use.voxels, use.bits,
      use.voxels > 0 ? static_cast<double>(use.bits) / static_cast<double>(use.voxels) : 0.0, use.index_bits);
  if (use.swatches > 0) text += fmt::format(", {} colours", use.swatches);
  return text + fmt::format(", error {:.3g} from surface to voxels, {:.3g} back ({:.2f} and {:.2f} of the diagonal)\n",
                            use.surface_error, use.voxel_error, per_diagonal(use, use.surface_error),
                            per_diagonal(use, use.voxel_error));
}

} // namespace

std::string proxies_text(const FileSummary& s, bool all) {
  constexpr size_t kLines = 8;
  std::string text;
  const size_t lines = all ? s.proxies.size() : std::min(s.proxies.size(), kLines);
  for (size_t i = 0; i < lines; ++i) text += line_of(s.proxies[i]);
  if (lines < s.proxies.size())
    text += fmt::format(grouped(), "{:L} more proxies (-v lists all)\n", s.proxies.size() - lines);
  return text.empty() ? text : text + "\n";
}

std::string proxies_requirement(const FileSummary& s) {
  if (s.proxies.empty()) return {};
  double error = 0.0;
  for (const ProxySummary& use : s.proxies) error = std::max({error, use.surface_error, use.voxel_error});
  return fmt::format(grouped(),
                     "proxies kept: requested by --proxy, {:L} of {:L} geometries, {:L} bytes, error at most {:.3g}",
                     s.proxies.size(), s.geometries, s.bytes.proxies, error);
}

nlohmann::json proxies_json(const FileSummary& s) {
  nlohmann::json json = nlohmann::json::array();
  for (const ProxySummary& use : s.proxies)
    json.push_back({{"geometry", use.name},
                    {"kind", use.kind == voxels::kFieldProxy ? "sdf" : "voxels"},
                    {"size", use.size},
                    {"edge", use.edge},
                    {"surface", surface_of(use)},
                    {"closed", (use.flags & voxels::kClosedSource) != 0},
                    {"filled", (use.flags & voxels::kFilled) != 0},
                    {"signed", (use.flags & voxels::kSigned) != 0},
                    {"voxels", use.voxels},
                    {"stored_voxels", use.stored_voxels},
                    {"bits", use.bits},
                    {"index_bits", use.index_bits},
                    {"colours", use.swatches},
                    {"surface_error", use.surface_error},
                    {"voxel_error", use.voxel_error}});
  return json;
}

} // namespace packtrace
