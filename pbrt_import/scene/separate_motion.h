#pragma once

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Makes Scene::motion of a scene's animations. Moving shapes outside objects and moving instances keep their numbers.
/// A moving shape of an object becomes a separate object, "OBJECT/MESH", with an instance behind each instance of
/// the object; an object that has no other shapes disappears. So afterwards every instance moves as a whole.
/// Shapes, instances and cameras keep their transforms of Scene::time. Without animations nothing changes: the importer
/// has made Scene::motion of glTF files. Call it once, before anything refers to instance numbers.
void separate_motion(Scene& scene);

/// A track that keeps a map.
MotionTrack constant_track(const DAffine& map);

} // namespace packtrace
