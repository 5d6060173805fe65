//! Every way of reading a sequence.

use std::path::Path;

/// Reads whole tables, frame after frame, one frame, and the checksums. Errors are what is hoped for.
pub fn use_all(path: &Path) {
    let Ok(reader) = open_structure::format::open(path) else { return };
    let _ = reader.read_all();
    if let Ok(frames) = reader.frames() {
        for frame in frames {
            if frame.is_err() {
                break;
            }
        }
    }
    if let Ok(list) = reader.frame_list()
        && let Some(frame) = list.last()
    {
        let _ = reader.frame(frame.frame_id);
        let _ = reader.frame_at(frame.stamp_nanos);
    }
    let _ = reader.verify_container();
}
