#pragma once

#include <CLI/CLI.hpp>

namespace packtrace {

/// Formats help with wrapped lines, and with option values as the user types them: "{none,fast,small}", "FILE".
class HelpFormatter final : public CLI::Formatter {
public:
  HelpFormatter();
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
};

} // namespace packtrace
