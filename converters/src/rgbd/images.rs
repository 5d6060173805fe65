//! The images of a frame, decoded.

use opencv::core::Mat;

use super::{DepthMap, Error, RawFrame, RawSequence, depth_file, picture};

/// The images of a frame.
#[derive(Debug)]
pub struct Images {
    /// Brightness: 8 bits, one channel, as large as the camera's image.
    pub grey: Mat,
    /// Depth within the camera's range.
    pub depth: DepthMap,
}

impl RawSequence {
    /// Both images of a frame.
    ///
    /// # Errors
    /// [`Error::Io`] where a file cannot be read; [`Error::Image`] where it is no image of the camera's size in the
    /// dataset's format.
    pub fn images(&self, frame: &RawFrame) -> Result<Images, Error> {
        Ok(Images { grey: self.grey(frame)?, depth: self.depth(frame)? })
    }

    /// Brightness of a frame's colour image: 8 bits, one channel.
    ///
    /// # Errors
    /// Those of [`images`](Self::images).
    pub fn grey(&self, frame: &RawFrame) -> Result<Mat, Error> {
        picture::grey(&frame.colour, [self.camera.width, self.camera.height])
    }

    /// Depth map of a frame, without depths outside the camera's range.
    ///
    /// # Errors
    /// Those of [`images`](Self::images).
    pub fn depth(&self, frame: &RawFrame) -> Result<DepthMap, Error> {
        let samples = depth_file::read(&frame.depth, self.depth_format, &self.camera.projection())?;
        let (width, height) = (self.camera.width, self.camera.height);
        let mut map = DepthMap::of(width, height, samples)
            .ok_or_else(|| Error::image(&frame.depth, "a depth for each pixel", "another count"))?;
        map.limit(self.camera.depth_min.unwrap_or(0.0), self.camera.depth_max.unwrap_or(f64::INFINITY));
        Ok(map)
    }
}
