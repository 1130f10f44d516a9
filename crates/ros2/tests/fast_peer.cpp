// A peer of the bridge on Fast DDS, which is the default of ROS 2. Bodies are bytes, so it can be of any type:
//
//     fast_peer subscribe DOMAIN TOPIC TYPE        prints each message in hexadecimal, its encapsulation first
//     fast_peer publish DOMAIN TOPIC TYPE HEX      sends a message again and again
//     fast_peer call DOMAIN SERVICE TYPE HEX       asks a service as rmw_fastrtps does, and prints its answer
//
// TOPIC, SERVICE and TYPE are those of ROS and DDS: /cmd_vel, /level/get_parameters, std_msgs::msg::dds_::Float64_; of a
// service, the type up to _Request_. On 127.0.0.1 alone.

#include <chrono>
#include <cstdio>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastrtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

using namespace eprosima::fastdds::dds;
using namespace eprosima::fastrtps::rtps;
using Bytes = std::vector<unsigned char>;

constexpr unsigned MOST_BYTES = 65536;

// A type whose values are its bytes.
class Raw : public TopicDataType {
public:
    explicit Raw(const std::string& name) {
        setName(name.c_str());
        m_typeSize = MOST_BYTES;
        m_isGetKeyDefined = false;
        auto_fill_type_information(false);
        auto_fill_type_object(false);
    }
    bool serialize(void* data, SerializedPayload_t* payload) override {
        const auto& bytes = *static_cast<Bytes*>(data);
        memcpy(payload->data, bytes.data(), bytes.size());
        payload->length = bytes.size();
        payload->encapsulation = CDR_LE;
        return true;
    }
    bool deserialize(SerializedPayload_t* payload, void* data) override {
        static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] { return static_cast<Bytes*>(data)->size(); };
    }
    void* createData() override { return new Bytes; }
    void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
    bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

Bytes from_hex(const std::string& text) {
    Bytes bytes;
    for (size_t at = 0; at + 1 < text.size(); at += 2) bytes.push_back(std::stoi(text.substr(at, 2), nullptr, 16));
    return bytes;
}

void print(const Bytes& bytes) {
    for (auto byte : bytes) printf("%02x", byte);
    printf("\n");
    fflush(stdout);
}

struct Peer {
    DomainParticipant* participant;

    explicit Peer(int domain) {
        DomainParticipantQos qos;
        qos.transport().use_builtin_transports = false;
        auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
        transport->interfaceWhiteList.push_back("127.0.0.1");
        qos.transport().user_transports.push_back(transport);
        for (int index = 0; index < 4; ++index) {
            Locator_t locator;
            IPLocator::setIPv4(locator, "127.0.0.1");
            locator.port = 7410 + 250 * domain + 2 * index;
            qos.wire_protocol().builtin.initialPeersList.push_back(locator);
        }
        participant = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    }
    Topic* topic(const std::string& name, const std::string& type) {
        TypeSupport support(new Raw(type));
        support.register_type(participant);
        return participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
    }
    DataReader* reader(Topic* topic) {
        DataReaderQos qos;
        qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
        qos.history().depth = 10;
        qos.endpoint().history_memory_policy = PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
        return participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT)->create_datareader(topic, qos);
    }
    DataWriter* writer(Topic* topic) {
        DataWriterQos qos;
        qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
        qos.history().depth = 10;
        qos.endpoint().history_memory_policy = PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
        return participant->create_publisher(PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, qos);
    }
};

void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

int main(int count, char** words) {
    if (count < 5) return 2;
    const std::string verb = words[1], name = words[3], type = words[4];
    Peer peer(std::stoi(words[2]));
    Bytes bytes = from_hex(count > 5 ? words[5] : "");
    SampleInfo info;
    if (verb == "subscribe") {
        DataReader* reader = peer.reader(peer.topic("rt" + name, type));
        printf("ready\n");
        fflush(stdout);
        for (;; pause_ms(2)) {
            while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK)
                if (info.valid_data) print(bytes);
        }
    }
    if (verb == "publish") {
        DataWriter* writer = peer.writer(peer.topic("rt" + name, type));
        printf("ready\n");
        fflush(stdout);
        for (;; pause_ms(20)) writer->write(&bytes);
    }
    // What rmw_fastrtps does: the request names the reader that waits, the answer the request.
    DataReader* reader = peer.reader(peer.topic("rr" + name + "Reply", type + "_Response_"));
    DataWriter* writer = peer.writer(peer.topic("rq" + name + "Request", type + "_Request_"));
    printf("ready\n");
    fflush(stdout);
    PublicationMatchedStatus there;
    do {
        pause_ms(20);
        writer->get_publication_matched_status(there);
    } while (there.current_count == 0);
    pause_ms(1000);
    WriteParams asked;
    asked.related_sample_identity().writer_guid() = reader->guid();
    writer->write(&bytes, asked);
    const auto number = asked.sample_identity().sequence_number();
    for (;; pause_ms(2)) {
        while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
            const auto& answered = info.related_sample_identity;
            const bool is_ours = answered.writer_guid() == reader->guid() || answered.writer_guid() == writer->guid();
            if (info.valid_data && is_ours && answered.sequence_number() == number) {
                print(bytes);
                return 0;
            }
        }
    }
}
