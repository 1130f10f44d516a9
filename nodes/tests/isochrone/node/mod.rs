//! The node `level`, which runs in a process of its own, and a client that operates it.

use isochrone_control::{
    Client, ClientError, Code, DescribeParams, GetParams, Params, Refusal, SetParams, SetResult,
    Values,
};
use isochrone_ipc::{Participant, ipc};

use isochrone_testing::plants::tank;
use isochrone_testing::{Domain, PATIENCE, Process, wait_until};

pub(crate) struct Node {
    pub(crate) client: Client<ipc::Service>,
    pub(crate) participant: Participant<ipc::Service>,
    pub(crate) process: Process,
    pub(crate) domain: Domain,
}

impl Node {
    /// Runs a configuration whose node is called `level`.
    pub(crate) fn start(text: &str) -> Self {
        let (domain, process) = tank(text);
        let participant = domain.join("operator");
        let client = Client::connect(&participant, "level", PATIENCE).unwrap();
        Self { client, participant, process, domain }
    }

    #[track_caller]
    pub(crate) fn call<P: Params>(&mut self, params: &P) -> P::Result {
        self.client.call(params).unwrap()
    }

    #[track_caller]
    pub(crate) fn refused<P: Params>(&mut self, params: &P) -> Refusal
    where
        P::Result: std::fmt::Debug,
    {
        match self.client.call(params).unwrap_err() {
            ClientError::Refused(failure) => failure,
            error => panic!("{error}"),
        }
    }

    #[track_caller]
    pub(crate) fn get(&mut self, names: &[&str]) -> Values {
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        self.call(&GetParams { names, ..GetParams::default() }).values
    }

    /// The cycle that a task is in.
    pub(crate) fn cycle(&mut self, task: &str) -> u64 {
        let tasks = self.call(&DescribeParams {}).tasks;
        tasks.into_iter().find(|found| found.name == task).unwrap().cycle
    }

    /// Two requests may be answered within one period, and on a busy machine a task may not have been
    /// on its CPU between them.
    #[track_caller]
    pub(crate) fn wait_for_cycle(&mut self, task: &str, cycle: u64) {
        wait_until(&format!("{task:?} is in cycle {cycle}"), || self.cycle(task) >= cycle);
    }

    /// Sets values so many cycles ahead, and returns the cycle that was asked for. On a busy machine it may
    /// have begun before the node is asked; then again.
    #[track_caller]
    pub(crate) fn set_ahead(
        &mut self,
        task: &str,
        cycles: u64,
        values: &SetParams,
    ) -> (u64, SetResult) {
        for _ in 0..20 {
            let at = self.cycle(task) + cycles;
            match self.client.call(&SetParams { at: Some(at.into()), ..values.clone() }) {
                Ok(done) => return (at, done),
                Err(ClientError::Refused(failure)) if failure.code == Code::TooLate => {}
                Err(error) => panic!("{error}"),
            }
        }
        panic!("{cycles} cycles ahead were too late twenty times");
    }
}
