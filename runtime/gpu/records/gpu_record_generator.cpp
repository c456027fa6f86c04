// Writes the GLSL of record_table.h and of the constants that kernels share with the CPU's kernels.
// Usage: gpu_record_generator OUT.glsl

#include <cstdio>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <limits>
#include <string>

#include "compress/format/cluster/normal_codec.h"
#include "runtime/denoise/kernels/filter_rows.h"
#include "runtime/denoise/kernels/history_rows.h"
#include "runtime/denoise/kernels/trend.h"
#include "runtime/denoise/kernels/units.h"
#include "runtime/gpu/records/record_table.h"
#include "runtime/trace/packed/kernels/enter.h"
#include "runtime/trace/packed/kernels/triangle_test.h"

namespace packtrace::gpu {
namespace {

void write_record(std::ostream& out, const GlslRecord& record) {
  out << "struct " << record.name << " {\n";
  for (const GlslField& field : record.fields) {
    out << "  " << field.type << ' ' << field.name;
    if (field.count > 1) out << '[' << field.count << ']';
    out << ";\n";
  }
  out << "};\n";
}

void write(std::ostream& out, const char* name, float value) {
  out << "const float " << name << " = " << std::setprecision(std::numeric_limits<float>::max_digits10)
      << std::scientific << value << std::defaultfloat << ";\n";
}

void write(std::ostream& out, const char* name, uint32_t value) {
  out << "const uint " << name << " = " << value << "u;\n";
}

void write_constants(std::ostream& out) {
  write(out, "kBoxPad", packed::kBoxPad);
  write(out, "kMinTopPad", packed::kMinTopPad);
  write(out, "kMinTopDirection", packed::kMinDirectionComponent);
  write(out, "kFar", static_cast<float>(packed::kFar));
  write(out, "kUnitRounding", static_cast<float>(packed::kUnitRounding));
  write(out, "kEdgeError", packed::kEdgeError);
  write(out, "kSmallestEdge", packed::kSmallestEdge);
  write(out, "kTopLeaf", packed::kTopLeaf);
  write(out, "kIndexBitsShift", packed::kIndexBitsShift);
  write(out, "kInnerChild", uint32_t{baked::kInnerChild});
  write(out, "kOcclusionClass", uint32_t{baked::kVisibleToOcclusion});
  write(out, "kMaskedCluster", kMaskedCluster);
  write(out, "kExactVertices", kExactVertices);
  write(out, "kGraded", kGraded);
  write(out, "kInexactDifferences", kInexactDifferences);
  write(out, "kFineTree", kFineTree);
  write(out, "kNoPoint", kNoPoint);
  write(out, "kNetOrder", kNetOrder);
  write(out, "kDirectionOrder", kDirectionOrder);
  write(out, "kRandomOrder", kRandomOrder);
}

void write_surface_constants(std::ostream& out) {
  write(out, "kNoInstance", kNoInstance);
  write(out, "kHasNormals", kHasNormals);
  write(out, "kViewZPlane", kViewZPlane);
  write(out, "kNormalPlane", kNormalPlane);
  write(out, "kInstancePlane", kInstancePlane);
  write(out, "kMotionPlane", kMotionPlane);
  write(out, "kPreviousZPlane", kPreviousZPlane);
  write(out, "kPositionPlane", kPositionPlane);
  write(out, "kGeometricPlane", kGeometricPlane);
  write(out, "kOffsetPlane", kOffsetPlane);
}

/// @param value of a NormalFormat
template <typename Value>
void write_formats(std::ostream& out, const char* name, const Value& value) {
  out << "const uint " << name << '[' << kNormalFormats.size() << "] = uint[](";
  for (size_t i = 0; i < kNormalFormats.size(); ++i) out << (i > 0 ? ", " : "") << value(kNormalFormats[i]) << 'u';
  out << ");\n";
}

void write_normal_constants(std::ostream& out) {
  write(out, "kZsignNormals", static_cast<uint32_t>(NormalFamily::kZsign));
  write(out, "kAxisNormals", static_cast<uint32_t>(NormalFamily::kAxis));
  write_formats(out, "kNormalFamily", [](const NormalFormat& f) { return static_cast<uint32_t>(f.family); });
  write_formats(out, "kNormalCharts", [](const NormalFormat& f) { return f.charts; });
  write_formats(out, "kNormalXCodes", [](const NormalFormat& f) { return f.x_codes; });
  write_formats(out, "kNormalYCodes", [](const NormalFormat& f) { return f.y_codes; });
  write(out, "kZsignXStep", 2.0f / static_cast<float>(kZsignXLast));
  write(out, "kZsignYStep", 2.0f / static_cast<float>(kZsignYLast));
  write(out, "kAxisSlope", static_cast<float>(kAxisSlope));
  write(out, "kAxisCubic", static_cast<float>(kAxisCubic));
}

void write_denoiser_constants(std::ostream& out) {
  write(out, "kHasHistory", kHasHistory);
  write(out, "kFollowMotion", kFollowMotion);
  write(out, "kKeepGuides", kKeepGuides);
  write(out, "kHasPreviousZ", kHasPreviousZ);
  write(out, "kHasLimits", kHasLimits);
  write(out, "kTestInstances", kTestInstances);
  write(out, "kStratified", kStratified);
  write(out, "kLastPass", kLastPass);
  write(out, "kStillMotion", kStillMotion);
  write(out, "kNearestDepth", kNearestDepth);
  write(out, "kFarthestDepth", kFarthestDepth);
  write(out, "kNormalUnit", kNormalUnit);
  write(out, "kMomentUnits", kMomentUnits);
  write(out, "kMinHistoryWeight", kMinHistoryWeight);
  write(out, "kLostWeight", kLostWeight);
  write(out, "kNearbyRadius", uint32_t{kNearbyRadius});
  write(out, "kNearbyReach", kNearbyReach);
  write(out, "kMinSharpenWeight", kMinSharpenWeight);
  write(out, "kAoUnits", float{kAoUnits});
  write(out, "kPrecisionUnits", kPrecisionUnits);
  write(out, "kMaxPrecision", kMaxPrecision);
  write(out, "kMaxVariance", kMaxVariance);
  write(out, "kLoneBase", kLoneBase);
  write(out, "kLoneYoung", kLoneYoung);
  write(out, "kMinGuide", float{kMinGuide});
  write(out, "kMaxBend", kMaxBend);
  write(out, "kLoneGuide", uint32_t{kLoneGuide});
  write(out, "kCompany", uint32_t{kCompany});
  write(out, "kStraight", uint32_t{kStraight});
  write(out, "kDiagonal", uint32_t{kDiagonal});
  write(out, "kMaxDeviations", uint32_t{kMaxDeviations});
  write(out, "kTrendSteps", Trend::kSteps);
  write(out, "kTrendFactor", Trend::kFactor);
  out << "const float kTrendGrowth[" << trend_growth().size() << "] = float[](";
  for (size_t e = 0; e < trend_growth().size(); ++e) out << (e > 0 ? ", " : "") << std::scientific << trend_growth()[e];
  out << ");\n" << std::defaultfloat;
}

} // namespace
} // namespace packtrace::gpu

int main(int argc, char** argv) {
  using namespace packtrace::gpu;
  if (argc != 2) {
    std::cerr << "usage: gpu_record_generator OUT.glsl\n";
    return 2;
  }
  std::ofstream out(argv[1]);
  out << "// Written by gpu_record_generator from record_table.h.\n";
  write_constants(out);
  write_surface_constants(out);
  write_normal_constants(out);
  write_denoiser_constants(out);
  for (const GlslRecord& record : kRecords) write_record(out, record);
  out.close();
  if (!out) {
    std::remove(argv[1]);
    std::cerr << argv[1] << ": cannot write\n";
    return 6;
  }
  return 0;
}
