//! The page of a running node in a browser.

use crate::browser;
use crate::browser::Browser;
use crate::served::{Served, served_tank};
use isochrone_testing::plants::tank;
use isochrone_testing::{Domain, wait_until};
use serde_json::{Value, json};

#[test]
fn curves_move_a_parameter_is_set_and_a_node_that_went_away_comes_back() {
    let (domain, node) = tank(&served_tank());
    let Some(browser) = Browser::start(&domain) else { return };
    let served = Served::start(&domain, "tank --allow-write");
    browser.resize(1400, 1000);
    browser.open(&served.url);
    browser.wait_for_text("#node", "tank");
    browser.wait_for_text("#state", "runs");
    assert_eq!(browser.run("return location.hash"), "", "the token does not stay in the address");

    // A search and a tick, as people do it.
    browser.run(
        "const search = document.getElementById('search'); search.value = 'saw.value'; \
         search.dispatchEvent(new Event('input'))",
    );
    browser.wait_for_text("#count", "1 of ");
    browser.run("document.querySelector('#table tr.signal input').click()");
    let drawn = "return [...document.querySelectorAll('.strip canvas')].at(-1).toDataURL()";
    browser.wait_for_text("#strips", "saw.value");
    browser.wait_for_text("#strips .strip:last-child .range", "max ");
    let before = browser.run(drawn);
    wait_until("the curve moves", || browser.run(drawn) != before);
    browser.wait_for_text("#task-list", "all seen");
    browser.run("document.getElementById('pause').click()");
    browser.wait_for_text("#pause", "Go on");
    // It is drawn once more, with the time of the pause at its axis.
    wait_until("the picture stands", || {
        let paused = browser.run(drawn);
        std::thread::sleep(std::time::Duration::from_millis(200));
        browser.run(drawn) == paused
    });
    browser.run("document.getElementById('pause').click()");
    browser.wait_for_text("#alarm-list", "level");

    browser.run(
        "const search = document.getElementById('search'); search.value = 'ramp rate'; \
         search.dispatchEvent(new Event('input'))",
    );
    browser.wait_for_text("#table tr.signal .value", "10");
    browser.run("document.querySelector('#table tr.signal .name button').click()");
    browser.wait_for_text("#chosen", "0 to 50");
    let set = |value: &str| {
        browser.run(&format!(
            "document.getElementById('setting-value').value = '{value}'; \
             document.querySelector('#setting button').click()"
        ));
    };
    set("60");
    browser.wait_for_text("#told", "60 is outside of the limits: 0 to 50");
    // The browser says that the answer was not 200.
    assert!(browser.complaints().iter().all(|it| it["message"].as_str().unwrap().contains("409")));
    set("7.5");
    browser.wait_for_text("#told", "set ramp.setChangeRate to 7.5 1/s, from cycle");
    browser.wait_for_text("#table tr.signal .value", "7.5");
    let get = || domain.run("get tank ramp.setChangeRate").expect_code(0).stdout;
    assert_eq!(get().trim(), "7.5");
    browser.run("document.querySelector('#told button').click()");
    browser.wait_for_text("#told", "taken back from cycle");
    assert_eq!(get().trim(), "10");

    node.kill();
    browser.wait_for_text("#notice", "The node is gone");
    browser.wait_for(
        "no value stays",
        "return document.querySelector('#table tr.signal .value').innerText === '–'",
    );
    let _second = domain.start_node("tank.toml", &served_tank(), "");
    browser.wait_for_text("#notice", "The node came back");
    browser.wait_for_text("#table tr.signal .value", "10");
    let before = browser.run(drawn);
    wait_until("the curve moves again", || browser.run(drawn) != before);
    assert_eq!(browser.complaints(), [] as [Value; 0]);

    // What the page showed when its server ended is not true any more.
    served.process.stop().expect_code(0);
    browser.wait_for_text("#state", "not connected");
    // Longer than the page takes to try again, and to look at its state.
    std::thread::sleep(std::time::Duration::from_millis(2500));
    browser.wait_for(
        "no value stays",
        "return document.querySelector('#table tr.signal .value').innerText === '–' \
           && document.getElementById('state').innerText.includes('not connected')",
    );
    drop(browser);
}

#[test]
fn a_page_that_is_opened_again_shows_the_curves_that_were_chosen_from_before_it_was_closed() {
    let (domain, _node) = tank(&served_tank());
    let Some(browser) = Browser::start(&domain) else { return };
    let served = Served::start(&domain, "tank");
    let names = "return [...document.querySelectorAll('.strip .label')].map(it => it.textContent)";
    let tick = "document.querySelector('#table tr.signal input').click()";
    browser.open(&served.url);
    browser.run(
        "const search = document.getElementById('search'); search.value = 'saw.value'; \
         search.dispatchEvent(new Event('input'))",
    );
    browser.wait_for_text("#count", "1 of ");
    browser.run(tick);
    browser.wait_for_text("#strips .strip:last-child .range", "max ");
    let chosen = browser.run(names);
    assert!(chosen.to_string().contains("saw.value"), "{chosen}");
    browser.open("about:blank");
    browser.open(&served.url);
    browser.wait_for_text("#strips .strip:last-child .range", "max ");
    assert_eq!(browser.run(names), chosen);
    assert_eq!(browser.complaints(), [] as [Value; 0]);
}

#[test]
fn the_page_fits_a_screen_and_a_phone_and_a_reader_cannot_set() {
    let (domain, _node) = tank(&served_tank());
    let Some(browser) = Browser::start(&domain) else { return };
    let served = Served::start(&domain, "tank");
    for (width, height) in [(1400, 1000), (390, 844)] {
        browser.resize(width, height);
        browser.open(&served.url);
        browser.wait_for_text("#table tr.signal .value", "0");
        browser.wait_for(
            "curves",
            "return document.getElementById('strips').textContent.includes('max ')",
        );
        let loose = browser.run(
            "const page = document.documentElement; \
             const beyond = [...document.querySelectorAll('section, .strip canvas, #table, .task table, button, input')] \
               .filter(it => it.getClientRects().length && it.getBoundingClientRect().right > page.clientWidth + 1); \
             return [page.scrollWidth - page.clientWidth, beyond.map(it => it.outerHTML.slice(0, 80))]",
        );
        assert_eq!(loose, json!([0, []]), "{width} x {height}");
        let empty = browser.run(
            "return [...document.querySelectorAll('.strip canvas, .task canvas')].filter(it => it.width < 200).length",
        );
        assert_eq!(empty, 0, "{width} x {height}");
        let unnamed = browser.run(
            "return [...document.querySelectorAll('button, input, select, canvas')].filter(it => \
               !(it.innerText || it.getAttribute('aria-label') || it.labels?.length)).map(it => it.outerHTML)",
        );
        assert_eq!(unnamed, json!([]), "everything has a name for who cannot see it");
    }
    let cut = browser.run(
        "const box = document.getElementById('box').getBoundingClientRect(); \
         return [...document.querySelector('#table tr.signal').querySelectorAll('.name, .value, .worth, .role')] \
           .filter(it => !it.checkVisibility() || it.scrollWidth > it.clientWidth + 1 \
             || it.getBoundingClientRect().right > box.right).map(it => it.className)",
    );
    assert_eq!(cut, json!([]), "quality and role are in sight on a phone");
    browser.run(
        "const role = document.getElementById('role'); role.value = 'parameter'; \
         role.dispatchEvent(new Event('change')); document.querySelector('#table tr.signal .name button').click()",
    );
    browser.wait_for_text("#chosen", "isochrone view --allow-write");
    assert_eq!(browser.run("return document.getElementById('setting').checkVisibility()"), false);
    assert_eq!(browser.complaints(), [] as [Value; 0]);
    drop(browser);
}

#[test]
fn a_test_that_fails_leaves_no_browser_and_no_profile() {
    let domain = Domain::new();
    let profile = browser::profile(&domain);
    let failed = std::panic::catch_unwind(|| {
        let Some(browser) = Browser::start(&domain) else { return };
        browser.open("about:blank");
        assert!(profile.exists() && !browser::processes_of(&profile).is_empty());
        panic!("as a test that fails");
    });
    if let Err(why) = failed {
        assert_eq!(why.downcast_ref(), Some(&"as a test that fails"));
    }
    assert_eq!(browser::processes_of(&profile), []);
    assert!(!profile.exists(), "{}", profile.display());
}
