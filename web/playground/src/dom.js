// The page's elements by name, and its error messages.

export const $ = (id) => document.getElementById(id);

const sentence = (error) => error.message.replace(/^ist: /, '');

export function tell(error) {
  $('alert-told').textContent = sentence(error);
  $('alert').hidden = false;
}
export function untell() {
  $('alert').hidden = true;
}
/** Runs a function that may fail; the page then shows the reason. */
export async function attempt(act) {
  try {
    await act();
  } catch (error) {
    tell(error);
  }
}
