// SPDX-License-Identifier: MIT
//
// Where sequences of frames end up: in a cloud, a map, or files.
export module cilantro.cloud:sinks;

import cilantro.standard;
import cilantro.core;
import :combine;
import :each;
import :point_cloud;

namespace cilantro {

/// Receives frames of type `Frame` one after the other: an object with `add(frame)`, a function of
/// a frame, or a cloud, to which clouds are appended.
export template <class T, class Frame>
concept SinkFor = requires(T& sink, Frame&& frame) {
  sink.add(std::forward<Frame>(frame));
} || std::invocable<T&, Frame> || (PointCloud<T> && std::same_as<T, std::remove_cvref_t<Frame>>);

/// Passes every frame of a range to `sink`, and returns `sink`.
template <class T, std::ranges::input_range R>
  requires SinkFor<T, std::ranges::range_reference_t<R>>
T& accumulate_frames(T& sink, R&& frames) {
  if constexpr (PointCloud<T>) {
    std::vector<T> more;
    for (auto&& frame : frames)
      if constexpr (hands_frames_over<std::remove_cvref_t<R>>)
        more.emplace_back(std::move(frame));
      else
        more.emplace_back(std::forward<decltype(frame)>(frame));
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

/// Ends a sequence of frames: `frames | each(prepare) | accumulate_into(map)` passes each frame to
/// `map`, in order, and returns `map`. A temporary, such as a lambda, is copied for each use, and
/// the copy is returned. See `SinkFor`. After an exception, the sink has received the frames before
/// it; a cloud is unchanged.
export template <class T>
[[nodiscard]] auto accumulate_into(T& sink [[clang::lifetimebound]]) {
  return range_closure{[&sink]<std::ranges::input_range R>(R&& frames) -> T&
                         requires SinkFor<T, std::ranges::range_reference_t<R>>
                       { return accumulate_frames(sink, std::forward<R>(frames)); }};
}
export template <class T>
  requires(!std::is_lvalue_reference_v<T>)
[[nodiscard]] auto accumulate_into(T&& sink) {
  return range_closure{[sink = std::forward<T>(sink)]<std::ranges::input_range R>(R&& frames) -> T
                         requires SinkFor<T, std::ranges::range_reference_t<R>>
                       {
                         T copy = sink;
                         return std::move(accumulate_frames(copy, std::forward<R>(frames)));
                       }};
}

}  // namespace cilantro
