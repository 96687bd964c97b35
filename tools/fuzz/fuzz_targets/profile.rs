//! Profiles as JSON: any text is a profile that can be shown and compared, or an error.
#![no_main]

use etendue::profile::Profile;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(profile) = Profile::from_json(text) {
        profile.to_csv();
        profile.to_html(Some(&profile.since(&profile)));
        profile.plots();
        assert!(Profile::from_json(&profile.to_json()).is_ok());
    }
});
