//! Publishing frames: written in place into shared memory, sent, and only then announced.

use bench_dragon_ipc::service::{self, EventService, FrameService, Member, Service};
use bench_dragon_ipc::{BusError, Domain, FrameHeader, HandleState, require_shared_memory};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::prelude::{BackpressureStrategy, PortFactory as _};
use iceoryx2::sample_mut::SampleMut;

/// The source of an instance's frames.
///
/// The sample of the next frame is loaned right after the last one is sent, so that between a release and its frame
/// there is neither an allocation nor a search for free memory.
#[derive(Debug)]
pub(crate) struct FramePublisher {
    // Dropped in this order: the sample before its publisher, ports before their services.
    next: Option<SampleMut<Service, [HandleState], FrameHeader>>,
    publisher: Publisher<Service, [HandleState], FrameHeader>,
    notifier: Notifier<Service>,
    frames: FrameService,
    _events: EventService,
    handle_count: usize,
}

impl FramePublisher {
    /// Creates the frames' services, or takes over those that clients of an earlier source keep open.
    ///
    /// # Errors
    /// [`BusError::SharedMemoryFull`] where the frames of all possible readers would not fit, and as
    /// [`Member::frames`].
    pub(crate) fn create(domain: &Domain, member: &Member, bench_count: usize) -> Result<Self, BusError> {
        require_shared_memory(domain, service::frame_memory(bench_count))?;
        let (frames, events) = (member.frames()?, member.frame_events()?);
        let handle_count = bench_count + 1;
        let publisher = frames
            .publisher_builder()
            .initial_max_slice_len(handle_count)
            .max_loaned_samples(1)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|error| BusError::failed(service::FRAMES, error))?;
        let notifier = events.notifier_builder().create().map_err(|error| BusError::failed(service::FRAMES, error))?;
        let next = publisher.loan_slice(handle_count).map_err(|error| BusError::failed(service::FRAMES, error))?;
        Ok(Self { next: Some(next), publisher, notifier, frames, _events: events, handle_count })
    }

    /// Readers connected at present.
    pub(crate) fn reader_count(&self) -> usize {
        self.frames.dynamic_config().number_of_subscribers()
    }

    /// Publishes one frame: `fill` writes every handle in place, then the header is stamped and the frame sent.
    ///
    /// # Errors
    /// [`BusError::Failed`] where iceoryx2 has no memory left, which the limits of the service rule out.
    pub(crate) fn publish(
        &mut self,
        fill: impl FnOnce(&mut [HandleState]) -> FrameHeader,
        now_ns: impl FnOnce() -> u64,
    ) -> Result<(), BusError> {
        let mut sample = self.next.take().expect("a sample is loaned after each frame");
        let header = fill(sample.payload_mut());
        *sample.user_header_mut() = FrameHeader { published_ns: now_ns(), ..header };
        sample.send().map_err(|error| BusError::failed(service::FRAMES, error))?;
        // A reader that is gone or whose wake-ups are full is its own affair.
        let _ = self.notifier.notify();
        self.next = Some(
            self.publisher.loan_slice(self.handle_count).map_err(|error| BusError::failed(service::FRAMES, error))?,
        );
        Ok(())
    }
}
