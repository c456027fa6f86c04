#include "runtime/view/window/panels.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>
#include <imgui.h>

namespace packtrace {
namespace {

constexpr size_t kGraphFrames = 120;
constexpr float kPanelWidth = 324.0f, kMargin = 8.0f;
constexpr float kAlpha = 0.75f; ///< of the panels' background
constexpr float kWidgetWidth = 104.0f, kGraphHeight = 48.0f;

void text_line(const std::string& text) { ImGui::TextUnformatted(text.c_str(), text.c_str() + text.size()); }

void tooltip(const std::string& text) {
  if (!ImGui::IsItemHovered()) return;
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(ImGui::GetFontSize() * 28.0f);
  text_line(text);
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

/// A list to choose a word from. Returns whether another was chosen.
bool choose(const char* label, const std::vector<std::string>& words, std::string& word) {
  bool changed = false;
  if (!ImGui::BeginCombo(label, word.c_str())) return false;
  for (const std::string& candidate : words)
    if (ImGui::Selectable(candidate.c_str(), candidate == word)) word = candidate, changed = true;
  ImGui::EndCombo();
  return changed;
}

/// A slider or a field for a number. Returns whether the value was changed.
bool edit_number(const ViewSetting& s, const char* label, std::string& value) {
  const double number = std::strtod(value.c_str(), nullptr);
  const bool wide = s.high - s.low > 1000.0;
  bool changed = false;
  if (s.is_integer) {
    int whole = static_cast<int>(std::clamp(number, -2e9, 2e9));
    changed = wide ? ImGui::InputInt(label, &whole)
                   : ImGui::SliderInt(label, &whole, static_cast<int>(s.low), static_cast<int>(s.high), "%d",
                                      ImGuiSliderFlags_AlwaysClamp);
    if (s.rule == SettingRule::kOdd) whole |= 1;
    value = std::to_string(whole);
  } else {
    auto real = static_cast<float>(number);
    changed = wide ? ImGui::InputFloat(label, &real, 0.0f, 0.0f, "%.4g", ImGuiInputTextFlags_EnterReturnsTrue)
                   : ImGui::SliderFloat(label, &real, static_cast<float>(s.low), static_cast<float>(s.high), "%.4g",
                                        ImGuiSliderFlags_AlwaysClamp);
    value = setting_text(double{real});
  }
  return changed;
}

/// The widget of a setting. A double click on its name goes back to the default.
bool edit_setting(const ViewSetting& s, std::string& value) {
  value = s.value;
  const std::string label = "##" + s.name;
  bool changed = false;
  ImGui::SetNextItemWidth(kWidgetWidth);
  if (!s.words.empty()) {
    changed = choose(label.c_str(), s.words, value);
  } else if (s.is_switch) {
    bool on = value == "on";
    changed = ImGui::Checkbox(label.c_str(), &on);
    value = on ? "on" : "off";
  } else {
    changed = edit_number(s, label.c_str(), value);
  }
  ImGui::SameLine();
  const std::string shown = s.name.substr(s.name.find('.') == std::string::npos ? 0 : s.name.find('.') + 1);
  if (s.value == s.default_value)
    ImGui::TextDisabled("%s", shown.c_str());
  else
    text_line(shown);
  const bool reset = ImGui::IsItemHovered() && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left);
  const std::string range = s.words.empty() && !s.is_switch ? fmt::format("{:.6g} to {:.6g}, ", s.low, s.high) : "";
  tooltip(fmt::format("{}\n{}default {}", s.help, range, s.default_value));
  if (reset) value = s.default_value;
  return changed || reset;
}

void draw_settings(const std::vector<ViewSetting>& settings, size_t pane, FrameThread& frames) {
  static constexpr std::array<std::pair<const char*, const char*>, 4> kGroups{
      {{"frames", "Frames"}, {"ao", "Ambient occlusion"}, {"denoiser", "Denoiser"}, {"shading", "Shading"}}};
  for (const auto& [group, title] : kGroups) {
    if (!ImGui::CollapsingHeader(title)) continue;
    for (const ViewSetting& setting : settings) {
      std::string value;
      if (setting.group != group || !edit_setting(setting, value)) continue;
      frames.post([pane, name = setting.name, value](ViewSession& session, ViewControls&) {
        session.set_setting(pane, name, value);
      });
    }
  }
}

/// The files as tabs, of which a pane shows one.
void draw_tabs(size_t pane, const ViewSnapshot& shown, FrameThread& frames) {
  for (size_t i = 0; i < shown.files.size(); ++i) {
    const std::string& file = shown.files[i];
    const std::string name = fmt::format("{}##{}", file.substr(file.find_last_of('/') + 1), i);
    const bool active = i == shown.pane_files[pane];
    const float width = ImGui::CalcTextSize(name.c_str(), nullptr, true).x + 2 * ImGui::GetStyle().FramePadding.x;
    if (i > 0) {
      ImGui::SameLine();
      if (ImGui::GetContentRegionAvail().x < width) ImGui::NewLine();
    }
    ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(active ? ImGuiCol_TabActive : ImGuiCol_Tab));
    if (ImGui::Button(name.c_str()) && !active)
      frames.post([pane, i](ViewSession& session, ViewControls&) { session.set_file(pane, i); });
    ImGui::PopStyleColor();
    tooltip(file);
  }
}

/// Chooses the file and the view of a pane.
void draw_pane(size_t pane, const ViewSnapshot& shown, FrameThread& frames) {
  ImGui::PushID(static_cast<int>(pane));
  std::string layer = shown.layers[pane];
  ImGui::SetNextItemWidth(150.0f);
  if (choose(pane == 0 ? "view" : "second view", view_layer_names(), layer))
    frames.post([pane, layer](ViewSession& session, ViewControls&) { session.set_layer(pane, layer); });
  if (shown.files.size() > 1) draw_tabs(pane, shown, frames);
  ImGui::PopID();
}

void draw_split(const ViewSnapshot& shown, FrameThread& frames) {
  int mode = static_cast<int>(shown.split);
  bool changed = ImGui::RadioButton("one view", &mode, 0);
  ImGui::SameLine();
  changed = ImGui::RadioButton("split", &mode, 1) || changed;
  ImGui::SameLine();
  changed = ImGui::RadioButton("difference", &mode, 2) || changed;
  if (changed)
    frames.post([mode](ViewSession& session, ViewControls&) { session.set_split(static_cast<SplitMode>(mode)); });
  if (shown.split != SplitMode::kDifference) return;
  auto gain = static_cast<float>(shown.gain);
  ImGui::SetNextItemWidth(150.0f);
  if (ImGui::SliderFloat("gain", &gain, 1.0f, 100.0f, "%.3g", ImGuiSliderFlags_Logarithmic))
    frames.post([gain](ViewSession& session, ViewControls&) { session.set_gain(double{gain}); });
  if (shown.metrics)
    text_line(shown.metrics->rmse > 0.0 ? fmt::format("RMSE {:.4f}, PSNR {:.2f} dB, FLIP {:.4f}", shown.metrics->rmse,
                                                      shown.metrics->psnr, shown.metrics->flip)
                                        : "both pictures are equal");
}

void draw_help(bool& shown) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x / 2.0f, screen.y / 2.0f}, ImGuiCond_Appearing, {0.5f, 0.5f});
  if (ImGui::Begin("Keys and mouse", &shown, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings)) {
    std::string_view group;
    for (const KeyHelp& key : key_help()) {
      if (key.group != group) ImGui::TextDisabled("%s", std::string(group = key.group).c_str());
      text_line(fmt::format("  {:<16} {}", key.keys, key.text));
    }
  }
  ImGui::End();
}

/// At the right, so that the middle of the picture stays free.
void draw_pick(const Pick& pick, float bottom) {
  ImGui::SetNextWindowPos({ImGui::GetIO().DisplaySize.x - kMargin, bottom}, ImGuiCond_Always, {1.0f, 1.0f});
  ImGui::SetNextWindowSizeConstraints({kPanelWidth, 0.0f}, {2.0f * kPanelWidth, 2000.0f});
  ImGui::SetNextWindowBgAlpha(kAlpha);
  if (ImGui::Begin(fmt::format("Under the mouse: {}, {}###pick", pick.x, pick.y).c_str(), nullptr,
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoInputs |
                       ImGuiWindowFlags_NoFocusOnAppearing))
    for (const std::string& line : pick_lines(pick)) text_line(line);
  ImGui::End();
}

/// The times of frames, with lines at their median and 99th percentile.
void draw_graph(const std::vector<float>& ms, double median, double p99) {
  const float top = 1.1f * std::max(*std::ranges::max_element(ms), 1e-3f);
  ImGui::PlotLines("##ms", ms.data(), static_cast<int>(ms.size()), 0, nullptr, 0.0f, top,
                   {ImGui::GetContentRegionAvail().x, kGraphHeight});
  const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax();
  const auto line = [&](double value, ImU32 color) {
    const float y = hi.y - (hi.y - lo.y) * static_cast<float>(value) / top;
    ImGui::GetWindowDrawList()->AddLine({lo.x, y}, {hi.x, y}, color);
  };
  line(median, IM_COL32(120, 220, 120, 200));
  line(p99, IM_COL32(255, 120, 80, 200));
}

/// Rows with a bar for their part of the largest.
void draw_rows(const char* title, const FileContents::Rows& rows, const char* unit) {
  if (rows.empty()) return;
  ImGui::TextDisabled("%s", title);
  uint64_t largest = 1;
  for (const auto& [name, value] : rows) largest = std::max(largest, value);
  for (const auto& [name, value] : rows) {
    ImGui::ProgressBar(static_cast<float>(static_cast<double>(value) / static_cast<double>(largest)), {60.0f, 12.0f},
                       "");
    ImGui::SameLine();
    std::string words = name;
    std::ranges::replace(words, '_', ' ');
    text_line(fmt::format("{:>8.1f} {} {}", 1e-3 * static_cast<double>(value), unit, words));
  }
}

/// What the first pane's file consists of.
void draw_contents(const ViewSnapshot& shown, FrameThread& frames) {
  const bool open = ImGui::CollapsingHeader("File");
  frames.show_contents(open);
  if (!open || !shown.contents) return;
  const FileContents& contents = *shown.contents;
  draw_rows("bytes by stream", contents.streams, "kB");
  draw_rows("in memory for tracing", contents.resident, "kB");
  if (!contents.plan.empty()) ImGui::TextDisabled("levels of detail");
  for (const std::string& line : contents.plan) text_line(line);
  draw_rows("triangles by geometry", contents.traced, "k");
}

/// The message, or the command that makes the picture. Returns the top of the line.
float draw_message(const std::string& message, const std::string& command) {
  const std::string& text = message.empty() ? command : message;
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  if (text.empty()) return screen.y - kMargin;
  ImGui::SetNextWindowPos({kMargin, screen.y - kMargin}, ImGuiCond_Always, {0.0f, 1.0f});
  ImGui::SetNextWindowSize({screen.x - 2 * kMargin, 0.0f});
  ImGui::SetNextWindowBgAlpha(kAlpha);
  float top = screen.y - kMargin;
  if (ImGui::Begin("##message", nullptr,
                   ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoInputs |
                       ImGuiWindowFlags_NoFocusOnAppearing)) {
    ImGui::PushTextWrapPos(0.0f);
    text_line(text);
    ImGui::PopTextWrapPos();
    top -= ImGui::GetWindowHeight();
  }
  ImGui::End();
  return top - kMargin;
}

} // namespace

void Panels::add_frame(const ViewSnapshot& snapshot) {
  if (snapshot.frame_ms <= 0.0) return;
  ms_.push_back(static_cast<float>(snapshot.frame_ms));
  if (ms_.size() > kGraphFrames) ms_.erase(ms_.begin());
}

double Panels::fps() const {
  if (ms_.empty()) return 0.0;
  std::vector<float> sorted(ms_.end() - static_cast<ptrdiff_t>(std::min<size_t>(ms_.size(), 60)), ms_.end());
  std::ranges::sort(sorted);
  return 1e3 / double{std::max(sorted[sorted.size() / 2], 0.01f)};
}

void Panels::draw_times(const ViewSnapshot& snapshot) const {
  if (ms_.empty()) return;
  std::vector<float> sorted = ms_;
  std::ranges::sort(sorted);
  const double median = double{sorted[sorted.size() / 2]}, p99 = double{sorted[(sorted.size() * 99) / 100]};
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x - kMargin, kMargin}, ImGuiCond_Always, {1.0f, 0.0f});
  ImGui::SetNextWindowSizeConstraints({kPanelWidth, 0.0f}, {kPanelWidth, screen.y});
  ImGui::SetNextWindowBgAlpha(kAlpha);
  if (ImGui::Begin("Times", nullptr, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings)) {
    draw_graph(ms_, median, p99);
    text_line(fmt::format("median {:.1f} ms, 99 % below {:.1f} ms", median, p99));
    for (const auto& [name, member] : kPasses)
      if (const double s = snapshot.frame.report.times.*member; s > 0.0)
        text_line(fmt::format("{:<9}{:7.1f} ms", name, 1e3 * s));
    if (latency.count() > 0)
      text_line(fmt::format("input to picture {:.0f} ms, 95 % below {:.0f} ms", latency.percentile_ms(0.5),
                            latency.percentile_ms(0.95)));
    const PictureReport& r = snapshot.frame.report;
    text_line(fmt::format("{:.2f} M camera, {:.2f} M occlusion rays", 1e-6 * static_cast<double>(r.primary_rays),
                          1e-6 * static_cast<double>(r.ao_rays)));
    text_line(fmt::format("history {:.1f} frames, {} x {} traced", r.mean_history, snapshot.frame.traced.width,
                          snapshot.frame.traced.height));
  }
  ImGui::End();
}

void Panels::draw_views(const ViewSnapshot& snapshot, FrameThread& frames, const WindowActions& actions) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({kMargin, kMargin}, ImGuiCond_Always);
  ImGui::SetNextWindowSizeConstraints({kPanelWidth, 0.0f}, {kPanelWidth, screen.y * 0.8f});
  ImGui::SetNextWindowBgAlpha(kAlpha);
  if (ImGui::Begin("View", nullptr, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings)) {
    draw_pane(0, snapshot, frames);
    draw_split(snapshot, frames);
    if (snapshot.split != SplitMode::kOff) draw_pane(1, snapshot, frames);
    if (snapshot.split != SplitMode::kOff) {
      int pane = static_cast<int>(settings_pane_);
      ImGui::RadioButton("settings of the first", &pane, 0);
      ImGui::SameLine();
      ImGui::RadioButton("second", &pane, 1);
      settings_pane_ = static_cast<size_t>(pane);
    } else {
      settings_pane_ = 0;
    }
    draw_settings(snapshot.settings[settings_pane_], settings_pane_, frames);
    draw_contents(snapshot, frames);
    auto target = static_cast<float>(snapshot.target_ms);
    ImGui::SetNextItemWidth(kWidgetWidth);
    if (ImGui::SliderFloat("target, ms", &target, 0.0f, 200.0f, "%.0f", ImGuiSliderFlags_AlwaysClamp))
      frames.post([target](ViewSession& session, ViewControls&) { session.set_target_ms(double{target}); });
    tooltip("Milliseconds that a frame may take while something moves: above, its resolution falls. 0: no limit");
    if (ImGui::Button("Screenshot (P)")) frames.post_reading(actions.screenshot);
    ImGui::SameLine();
    if (ImGui::Button("Save settings")) frames.post(actions.save_settings);
    ImGui::SameLine();
    if (ImGui::Button("Help (I)")) help = !help;
    text_line(fmt::format("speed {:.3g} units per second{}{}{}{}", snapshot.speed, snapshot.orbits ? ", orbit" : "",
                          snapshot.plays ? ", plays" : "", snapshot.lights_turn ? ", lights turn" : "",
                          snapshot.paused ? ", paused" : ""));
    if (snapshot.recording) ImGui::TextColored({1.0f, 0.4f, 0.3f, 1.0f}, "recording the camera");
  }
  ImGui::End();
}

void draw_gizmo(const Gizmo& gizmo, std::optional<size_t> held) {
  static constexpr std::array<ImU32, 3> kColors{IM_COL32(235, 70, 60, 255), IM_COL32(70, 190, 70, 255),
                                                IM_COL32(70, 120, 245, 255)};
  static constexpr std::array<const char*, 3> kNames{"x", "y", "z"};
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  const auto at = [&](glm::dvec2 p) {
    return ImVec2(static_cast<float>(p.x) * screen.x, static_cast<float>(p.y) * screen.y);
  };
  ImDrawList* const back = ImGui::GetBackgroundDrawList();
  const ImVec2 centre = at(gizmo.centre);
  for (size_t axis = 0; axis < 3; ++axis) {
    if (!gizmo.tips[axis]) continue;
    const ImVec2 tip = at(*gizmo.tips[axis]);
    const float dx = tip.x - centre.x, dy = tip.y - centre.y, length = std::max(std::hypot(dx, dy), 1e-3f);
    const float ux = dx / length, uy = dy / length, head = std::min(10.0f, length);
    const ImVec2 neck(tip.x - head * ux, tip.y - head * uy);
    back->AddLine(centre, neck, kColors[axis], held == axis ? 5.0f : 3.0f);
    back->AddTriangleFilled(tip, {neck.x - 0.5f * head * uy, neck.y + 0.5f * head * ux},
                            {neck.x + 0.5f * head * uy, neck.y - 0.5f * head * ux}, kColors[axis]);
    back->AddText({tip.x + 8.0f * ux - 3.0f, tip.y + 10.0f * uy - 6.0f}, kColors[axis], kNames[axis]);
  }
  back->AddCircleFilled(centre, 4.0f, IM_COL32(255, 255, 255, 255));
}

void draw_loading(const std::string& file, const std::pair<std::string, double>& loading) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x / 2.0f, screen.y / 2.0f}, ImGuiCond_Always, {0.5f, 0.5f});
  if (ImGui::Begin("##loading", nullptr,
                   ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoInputs |
                       ImGuiWindowFlags_AlwaysAutoResize)) {
    ImGui::TextUnformatted(("loading " + file).c_str());
    ImGui::ProgressBar(static_cast<float>(loading.second), {std::clamp(screen.x / 2.0f, 1.0f, 320.0f), 0.0f}, "");
    ImGui::TextUnformatted(loading.first.empty() ? "rendering the first frame" : loading.first.c_str());
  }
  ImGui::End();
}

void Panels::draw(const ViewSnapshot& snapshot, FrameThread& frames, const WindowActions& actions) {
  if (help) draw_help(help);
  if (!shown) return;
  draw_views(snapshot, frames, actions);
  draw_times(snapshot);
  const float bottom = draw_message(frames.message(), snapshot.command);
  if (snapshot.pick) draw_pick(*snapshot.pick, bottom);
}

} // namespace packtrace
