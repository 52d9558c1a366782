function ask_tell(address, token)
% A lab that evaluates trials itself: ask, measure, tell. For MATLAB R2016b, GNU Octave 7, or newer.
%
%   ask_tell('http://127.0.0.1:8080')
%   ask_tell('http://127.0.0.1:8080', 'TOKEN')
%
% Requests are sent by the program curl, version 7.71 or newer.

if nargin < 2
    token = '';
end
subjects = request(address, token, 'GET', '/subjects?limit=1000');
% Objects with the same fields are a struct array, others a cell array.
subject = subjects.items(strcmp({subjects.items.pseudonym}, 'paper-1'));
study = request(address, token, 'POST', '/studies', struct( ...
    'subject_id', subject.id, 'evaluation', 'script', 'number_of_trials', 10));
for k = 1:study.number_of_trials
    trial = request(address, token, 'POST', ['/studies/' study.id '/ask'], struct('script', 'treadmill'));
    rmse = measure(trial.action);
    if isnan(rmse)
        result = struct('label', 'not_converged', 'reason', 'the walker stumbled');
    else
        result = struct('label', 'converged', 'gait_rmse_rad', rmse);
    end
    told = request(address, token, 'POST', ['/trials/' trial.id '/tell'], result);
    fprintf('trial %d: %s, %.4f rad\n', told.number, told.state, rmse);
end
best = request(address, token, 'GET', ['/studies/' study.id '/trials?state=converged&sort=gait_rmse_rad&limit=1']);
fprintf('best: trial %d, %.4f rad\n', best.items(1).number, best.items(1).gait_rmse_rad);
end

function rmse = measure(action)
% Stands in for the treadmill: Gait RMSE of a made-up walker, rad; NaN where it stumbles.
if action.a5 > 0.03 && action.a6 < 0.15
    rmse = NaN;
else
    rmse = 0.1 + 3 * abs(action.a5 - 0.026) + abs(action.a6 - 0.3) / 2;
end
end

function answer = request(address, token, method, path, body)
% The response of the service. All attempts at a change have the same key, so the change is made once.
folder = tempname();
mkdir(folder);
cleaner = onCleanup(@() remove(folder));
if isunix()
    system(['chmod 700 "' folder '"']);
end
file = @(name) strrep(fullfile(folder, name), '\', '/');
% The options are in a file, because other users can see the command line, and the token with it.
options = {['url = "' address '/api/v1' path '"'], ['request = "' method '"'], ['output = "' file('answer') '"'], ...
    'write-out = "%{http_code}"', 'silent', 'show-error', 'max-time = 60', 'retry = 5', 'retry-all-errors'};
if ~isempty(token)
    options{end + 1} = ['header = "Authorization: Bearer ' token '"'];
end
if nargin > 4
    [~, key] = fileparts(tempname());
    write(file('body'), jsonencode(body));
    options = [options, {'header = "Content-Type: application/json"', ['data-binary = "@' file('body') '"'], ...
        ['header = "Idempotency-Key: ' key sprintf('-%.6f', now()) '"']}];
end
write(file('options'), strjoin(options, sprintf('\n')));
[status, text] = system(['curl --config "' file('options') '"']);
if status ~= 0
    error('gaitwright:unreachable', 'No answer from %s: curl ended with status %d.', address, status);
end
answer = fileread(file('answer'));
code = str2double(text(end - 2:end));
if code >= 300
    error('gaitwright:problem', '%d: %s', code, answer);
end
answer = jsondecode(answer);
end

function write(path, text)
file = fopen(path, 'w', 'n', 'UTF-8');
fwrite(file, unicode2native(text, 'UTF-8'));
fclose(file);
end

function remove(folder)
delete(fullfile(folder, '*'));
rmdir(folder);
end
