#include "runtime/commands/view/file_watch.h"

#include <chrono>
#include <system_error>
#include <utility>

namespace packtrace {
namespace {

constexpr std::chrono::milliseconds kBetweenLooks{250};

} // namespace

FileWatch::FileWatch(std::function<void(size_t)> changed) : changed_(std::move(changed)), thread_([this] { loop(); }) {}

FileWatch::~FileWatch() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

FileWatch::Version FileWatch::version_of(const std::string& file) {
  std::error_code missing;
  Version version;
  version.bytes = std::filesystem::file_size(file, missing);
  version.exists = !missing;
  if (missing) version.bytes = 0;
  version.time = std::filesystem::last_write_time(file, missing);
  return version;
}

void FileWatch::add(const std::string& file) {
  const Version now = version_of(file);
  const std::lock_guard lock(mutex_);
  files_.push_back({file, now, now});
}

void FileWatch::run(std::function<void()> work) {
  {
    const std::lock_guard lock(mutex_);
    work_.push_back(std::move(work));
  }
  wake_.notify_all();
}

void FileWatch::loop() {
  std::unique_lock lock(mutex_);
  while (!quit_) {
    wake_.wait_for(lock, kBetweenLooks, [this] { return quit_ || !work_.empty(); });
    std::vector<std::function<void()>> work;
    work.swap(work_);
    std::vector<size_t> changed;
    for (size_t i = 0; i < files_.size(); ++i) {
      Watched& w = files_[i];
      const Version now = version_of(w.file);
      if (now == w.seen && !(now == w.known)) {
        w.known = now;
        changed.push_back(i);
      }
      w.seen = now;
    }
    lock.unlock();
    for (const auto& task : work) task();
    for (const size_t file : changed) changed_(file);
    lock.lock();
  }
}

} // namespace packtrace
