//! Views of image data: sample (x, y, c) lies at first + x·stride_x + y·stride_y + c·stride_c. Interleaved
//! or planar, rows or columns first are choices of strides; a region of interest is another `first` with
//! the same strides and the same data, so nothing is copied.

use crate::image::buffer::{Image, sample_count};

/// A borrowed image, or a rectangle or some channels of one.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    data: &'a [f32],
    first: usize,
    stride_x: usize,
    stride_y: usize,
    stride_c: usize,
    width: u32,
    height: u32,
    channels: usize,
}

impl<'a> View<'a> {
    /// A view of samples that lie pixel by pixel, or `None` where `data` holds too few.
    pub fn interleaved(
        data: &'a [f32],
        width: u32,
        height: u32,
        channels: usize,
    ) -> Option<View<'a>> {
        (sample_count(width, height, channels)? <= data.len()).then(|| View {
            data,
            first: 0,
            stride_x: channels,
            stride_y: channels * width as usize,
            stride_c: 1,
            width,
            height,
            channels,
        })
    }

    /// A view of samples that lie channel by channel, or `None` where `data` holds too few.
    pub fn planar(data: &'a [f32], width: u32, height: u32, channels: usize) -> Option<View<'a>> {
        (sample_count(width, height, channels)? <= data.len()).then(|| View {
            data,
            first: 0,
            stride_x: 1,
            stride_y: width as usize,
            stride_c: width as usize * height as usize,
            width,
            height,
            channels,
        })
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// How many channels a pixel has.
    pub fn channel_count(&self) -> usize {
        self.channels
    }

    /// The rectangle of `width` × `height` pixels whose top-left pixel is (x, y), or `None` where that
    /// reaches beyond this view.
    pub fn region(&self, x: u32, y: u32, width: u32, height: u32) -> Option<View<'a>> {
        let inside = x.checked_add(width)? <= self.width && y.checked_add(height)? <= self.height;
        inside.then(|| View {
            first: self.first + x as usize * self.stride_x + y as usize * self.stride_y,
            width,
            height,
            ..*self
        })
    }

    /// The `count` channels from `from` on, or `None` where there are not that many.
    pub fn channel_range(&self, from: usize, count: usize) -> Option<View<'a>> {
        (from.checked_add(count)? <= self.channels).then(|| View {
            first: self.first + from * self.stride_c,
            channels: count,
            ..*self
        })
    }

    /// Rows and columns exchanged.
    pub fn transposed(&self) -> View<'a> {
        View {
            stride_x: self.stride_y,
            stride_y: self.stride_x,
            width: self.height,
            height: self.width,
            ..*self
        }
    }

    /// Sample `c` of pixel (x, y).
    ///
    /// # Panics
    /// Outside of the view.
    pub fn get(&self, x: u32, y: u32, c: usize) -> f32 {
        assert!(
            x < self.width && y < self.height && c < self.channels,
            "sample ({x}, {y}, {c}) lies outside of {} × {} × {}",
            self.width,
            self.height,
            self.channels
        );
        self.data[self.first
            + x as usize * self.stride_x
            + y as usize * self.stride_y
            + c * self.stride_c]
    }

    /// The samples of pixel (x, y), one a channel.
    ///
    /// # Panics
    /// Outside of the view, as soon as a sample is taken.
    pub fn pixel(&self, x: u32, y: u32) -> impl ExactSizeIterator<Item = f32> + use<'a> {
        let view = *self;
        (0..view.channels).map(move |c| view.get(x, y, c))
    }

    /// Channel `c` of row `y`, from left to right.
    ///
    /// # Panics
    /// Outside of the view, as soon as a sample is taken.
    pub fn row(&self, y: u32, c: usize) -> impl ExactSizeIterator<Item = f32> + use<'a> {
        let view = *self;
        (0..view.width).map(move |x| view.get(x, y, c))
    }

    /// A copy with the given channel names, or `None` where there are more or fewer names than channels.
    pub fn to_image(&self, channels: Vec<String>) -> Option<Image> {
        let view = *self;
        let data = (0..view.height)
            .flat_map(|y| (0..view.width).flat_map(move |x| view.pixel(x, y)))
            .collect();
        Image::from_data(self.width, self.height, channels, data).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sample's value says where it lies: 100·y + 10·x + c.
    fn numbered(width: u32, height: u32, channels: usize) -> Image {
        let mut image = Image::new(width, height, vec!["c".into(); channels]);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            for c in 0..channels {
                image.set(x, y, c, (100 * y + 10 * x) as f32 + c as f32);
            }
        }
        image
    }

    #[test]
    fn a_region_shows_the_parents_samples_without_a_copy() {
        let image = numbered(5, 4, 3);
        let region = image.view().region(1, 2, 3, 2).unwrap();
        assert_eq!((region.width(), region.height()), (3, 2));
        assert_eq!(region.get(0, 0, 0), 210.0);
        assert_eq!(region.get(2, 1, 2), 332.0);
        assert_eq!(region.row(1, 1).collect::<Vec<_>>(), [311.0, 321.0, 331.0]);
        assert_eq!(region.data.as_ptr(), image.data().as_ptr());
    }

    #[test]
    fn regions_of_regions_add_their_corners() {
        let image = numbered(8, 8, 1);
        let outer = image.view().region(2, 3, 5, 4).unwrap();
        let inner = outer.region(1, 2, 2, 2).unwrap();
        assert_eq!(inner.get(0, 0, 0), 530.0);
        assert_eq!(inner.get(1, 1, 0), 640.0);
    }

    #[test]
    fn a_region_beyond_the_image_is_none() {
        let image = numbered(4, 4, 1);
        for (x, y, w, h) in [
            (1, 0, 4, 4),
            (0, 1, 4, 4),
            (u32::MAX, 0, 2, 1),
            (5, 5, 0, 0),
        ] {
            assert!(image.view().region(x, y, w, h).is_none(), "{x} {y} {w} {h}");
        }
        assert!(image.view().region(4, 4, 0, 0).is_some());
    }

    #[test]
    #[should_panic(expected = "outside")]
    fn a_region_does_not_show_its_parents_other_pixels() {
        let image = numbered(4, 4, 1);
        let _ = image.view().region(0, 0, 2, 2).unwrap().get(2, 0, 0);
    }

    #[test]
    fn channels_are_chosen_by_range() {
        let image = numbered(3, 3, 4);
        let two = image.view().channel_range(1, 2).unwrap();
        assert_eq!(two.pixel(2, 1).collect::<Vec<_>>(), [121.0, 122.0]);
        assert!(image.view().channel_range(3, 2).is_none());
    }

    #[test]
    fn planar_and_interleaved_data_show_the_same_image() {
        let image = numbered(3, 2, 2);
        let view = image.view();
        let planes: Vec<f32> = (0..2)
            .flat_map(|c| (0..2).flat_map(move |y| view.row(y, c)))
            .collect();
        let planar = View::planar(&planes, 3, 2, 2).unwrap();
        assert_eq!(planar.to_image(image.channels().to_vec()), Some(image));
        assert!(View::planar(&planes, 3, 2, 3).is_none());
    }

    #[test]
    fn transposing_exchanges_rows_and_columns() {
        let image = numbered(3, 2, 1);
        let turned = image.view().transposed();
        assert_eq!((turned.width(), turned.height()), (2, 3));
        assert_eq!(turned.get(1, 2, 0), image.get(2, 1, 0));
    }
}
