// SPDX-License-Identifier: MIT
//
// Where sequences of frames end: a cloud, a map, files.
export module cilantro.cloud:sinks;

import cilantro.standard;
import cilantro.core;
import :combine;
import :point_cloud;

namespace cilantro {

/// What takes frames of type `Frame` one after the other: an object with `add(frame)`, or a
/// function of a frame; a cloud takes clouds, which are appended to it.
export template <class T, class Frame>
concept SinkFor = requires(T& sink, Frame&& frame) {
  sink.add(std::forward<Frame>(frame));
} || std::invocable<T&, Frame> || (PointCloud<T> && std::same_as<T, std::remove_cvref_t<Frame>>);

/// Hands every frame of a range on to `sink`, and returns it.
template <class T, std::ranges::input_range R>
  requires SinkFor<T, std::ranges::range_reference_t<R>>
T& accumulate_frames(T& sink, R&& frames) {
  if constexpr (PointCloud<T>) {
    std::vector<T> more;
    for (auto&& frame : frames) more.emplace_back(std::forward<decltype(frame)>(frame));
    std::vector<const T*> parts{&sink};
    for (const T& cloud : more) parts.push_back(&cloud);
    sink = append_parts<typename T::scalar, T::static_dimension>(parts);
  } else {
    for (auto&& frame : frames)
      if constexpr (requires { sink.add(std::forward<decltype(frame)>(frame)); })
        sink.add(std::forward<decltype(frame)>(frame));
      else
        std::invoke(sink, std::forward<decltype(frame)>(frame));
  }
  return sink;
}

/// Where a line of frames ends: `frames | each(prepare) | accumulate_into(map)` hands each frame on
/// to `map`, in order, and is `map`. See `SinkFor`. What an exception leaves in it is what had been
/// handed on before; a cloud is then as it was.
export template <class T>
[[nodiscard]] auto accumulate_into(T& sink [[clang::lifetimebound]]) {
  return range_closure{[&sink]<std::ranges::input_range R>(R&& frames) -> T&
                         requires SinkFor<T, std::ranges::range_reference_t<R>>
                       { return accumulate_frames(sink, std::forward<R>(frames)); }};
}

}  // namespace cilantro
