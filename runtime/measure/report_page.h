#pragma once

#include <string_view>

/// The files of runtime/measure/report, which the build embeds (report/embed.cmake).
namespace packtrace::report_page {

extern const std::string_view kTemplate;     ///< report.html: HTML with {{placeholders}}
extern const std::string_view kStyle;        ///< report.css
extern const std::string_view kScript;       ///< the .js files, concatenated
extern const std::string_view kStyleSha256;  ///< hexadecimal, of kStyle
extern const std::string_view kScriptSha256; ///< hexadecimal, of kScript

} // namespace packtrace::report_page
