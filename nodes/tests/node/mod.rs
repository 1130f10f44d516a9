//! The node `level`, which runs in a process of its own, and a client that operates it.
#![allow(dead_code, reason = "each test file uses a part")]

use std::time::{Duration, Instant};

use isochrone_ipc::{Participant, ipc};
use isochrone_runtime::control::{
    Client, ClientError, DescribeParams, Failure, GetParams, Params, Values,
};

use crate::domain::{Domain, Process};

pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

pub(crate) struct Node {
    pub(crate) client: Client<ipc::Service>,
    pub(crate) participant: Participant<ipc::Service>,
    pub(crate) process: Process,
    pub(crate) domain: Domain,
}

impl Node {
    /// Runs a configuration whose node is called `level`.
    pub(crate) fn start(text: &str) -> Self {
        let domain = Domain::new();
        domain.write("node.toml", text);
        let mut process = domain.start("run node.toml");
        process.wait_for("is running");
        let participant = domain.join("operator");
        let client = Client::connect(&participant, "level", PATIENCE).unwrap();
        Self { client, participant, process, domain }
    }

    #[track_caller]
    pub(crate) fn call<P: Params>(&mut self, params: &P) -> P::Result {
        self.client.call(params).unwrap()
    }

    #[track_caller]
    pub(crate) fn refused<P: Params>(&mut self, params: &P) -> Failure
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
        let start = Instant::now();
        while self.cycle(task) < cycle {
            assert!(start.elapsed() < PATIENCE, "{task:?} did not reach cycle {cycle}");
        }
    }
}
