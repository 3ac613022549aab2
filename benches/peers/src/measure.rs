//! Measuring contenders alternately, so that what else the machine does falls on all of them.

use std::sync::Barrier;
use std::thread;
use std::time::{Duration, Instant};

/// One call of it evaluates a batch.
pub type Task = Box<dyn FnMut() + Send>;

/// The least time of a round, so that the clock and the start of threads do not matter.
const ROUND: Duration = Duration::from_millis(3);

/// Somebody who does the work, on one or several threads.
pub struct Contender {
    /// Contenders of one label are variants, of which the best counts.
    pub label: &'static str,
    tasks: Vec<Task>,
    /// Results of one call of one task.
    items: usize,
    /// Calls in a round.
    calls: usize,
    /// Million results a second, by round.
    rates: Vec<f64>,
}

impl Contender {
    /// A contender with a task for each thread; each makes `items` results a call.
    pub fn new(
        label: &'static str,
        threads: usize,
        items: usize,
        task: impl Fn() -> Task,
    ) -> Contender {
        Contender {
            label,
            tasks: (0..threads).map(|_| task()).collect(),
            items,
            calls: 1,
            rates: Vec::new(),
        }
    }

    /// A contender with one task, which finds threads by itself.
    pub fn single(label: &'static str, task: Task) -> Contender {
        Contender {
            label,
            tasks: vec![task],
            // One picture is a million of its millionth parts, so that the rate is in pictures.
            items: 1_000_000,
            calls: 1,
            rates: Vec::new(),
        }
    }

    /// The time of a round: of the slowest thread.
    fn round(&mut self) -> Duration {
        let calls = self.calls;
        let repeat = |task: &mut Task| {
            let begun = Instant::now();
            (0..calls).for_each(|_| task());
            begun.elapsed()
        };
        if let [task] = &mut self.tasks[..] {
            return repeat(task);
        }
        let barrier = Barrier::new(self.tasks.len());
        thread::scope(|scope| {
            let threads: Vec<_> = (self.tasks.iter_mut())
                .map(|task| {
                    scope.spawn(|| {
                        barrier.wait();
                        repeat(task)
                    })
                })
                .collect();
            let times = threads.into_iter().map(|thread| thread.join());
            times
                .map(Result::unwrap_or_default)
                .max()
                .unwrap_or_default()
        })
    }

    /// Warms up and finds how many calls make a round.
    fn prepare(&mut self) {
        loop {
            let time = self.round();
            if time >= ROUND {
                return;
            }
            let wanted = ROUND.as_secs_f64() / time.as_secs_f64().max(1e-9);
            self.calls = (self.calls as f64 * wanted.clamp(1.2, 100.0)).ceil() as usize;
        }
    }

    fn measure(&mut self) {
        let results = self.items * self.calls * self.tasks.len();
        let time = self.round();
        self.rates.push(results as f64 / time.as_secs_f64() * 1e-6);
    }
}

/// What the contenders reached.
pub struct Outcome {
    contenders: Vec<Contender>,
}

/// Lets them take turns.
pub fn compete(mut contenders: Vec<Contender>, rounds: usize) -> Outcome {
    contenders.iter_mut().for_each(Contender::prepare);
    for _ in 0..rounds {
        contenders.iter_mut().for_each(Contender::measure);
    }
    Outcome { contenders }
}

impl Outcome {
    /// Million results a second of the best contender of a label: the median.
    pub fn rate(&self, label: &str) -> Option<f64> {
        self.best(&[label])
            .map(|contender| median(&contender.rates))
    }

    /// The median over all rounds of the ratio of the best one of a label to the best one of
    /// others.
    pub fn ratio(&self, label: &str, others: &[&str]) -> Option<f64> {
        let (first, second) = (self.best(&[label])?, self.best(others)?);
        let pairs = first.rates.iter().zip(&second.rates);
        let ratios: Vec<f64> = pairs.map(|(first, second)| first / second).collect();
        Some(median(&ratios))
    }

    fn best(&self, labels: &[&str]) -> Option<&Contender> {
        let contenders = self.contenders.iter();
        contenders
            .filter(|contender| labels.contains(&contender.label))
            .max_by(|a, b| median(&a.rates).total_cmp(&median(&b.rates)))
    }
}

fn median(numbers: &[f64]) -> f64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
