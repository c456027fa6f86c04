#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "runtime/motion/displacements.h"
#include "runtime/view/view_file.h"

namespace packtrace {

/// The instances of a file that were moved by hand.
class HandMoves {
public:
  bool empty() const { return moved_.empty(); }

  /// Moves an instance by an additional offset. Its own motion ends: it stays at its place at rest plus the sum of its
  /// offsets. Throws Error(kUsage) for an instance that cannot move, and for places beyond 1e30.
  /// @param by world units
  void move(const ViewFile& file, uint32_t instance, DVec3 by);
  /// Removes the offset of an instance.
  void put_back(const ViewFile& file, uint32_t instance);

  /// The scene's motion with the moved instances; null if no instance was moved.
  const std::shared_ptr<const SceneMotion>& motion() const { return motion_; }
  /// The centre of an instance's box at a time, relative to SceneSource::origin().
  DVec3 centre(const ViewFile& file, uint32_t instance, double time_s) const;

  /// The file of keys with which `render --keys` moves the instances likewise.
  std::string keys_text(const ViewFile& file) const;
  /// The name of that file, for commands.
  const std::string& keys_file() const { return keys_file_; }
  /// Sets the file to which keys_text() was saved. The next move clears it.
  void set_keys_file(const std::string& name) { keys_file_ = name; }

private:
  std::vector<Displacement> displacements() const;
  void update(const ViewFile& file);

  std::map<uint32_t, DVec3> moved_; ///< by instance, from where it is at rest
  std::shared_ptr<const SceneMotion> motion_;
  std::string keys_file_{kUnsavedKeys};

  static constexpr const char* kUnsavedKeys = "moved.json";
};

} // namespace packtrace
