#pragma once

#include <CLI/CLI.hpp>

namespace packtrace {

/// CLI11's help with lines that fit a terminal, and with values as they are typed: "{none,fast,small}", "FILE".
class HelpFormatter final : public CLI::Formatter {
public:
  HelpFormatter();
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
};

} // namespace packtrace
